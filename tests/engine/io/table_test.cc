// Tables in every format: the same cells bit for bit, files of interrupted runs, and files that are
// no tables.
#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <thread>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"
#include "support/temp_folder.h"

namespace counterpoint::table_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEndings[] = {".csv", ".h5", ".npz", ".mcap"};

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

template <class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// A cell with a long decimal expansion; every seventh is empty.
double number(int row, int column) {
  if ((row + column) % 7 == 6) return std::numeric_limits<double>::quiet_NaN();
  return std::ldexp(1.0 / (3.0 + row + 1000.0 * column), (row * 37 + column * 11) % 2000 - 1000) *
         (row % 2 ? 1 : -1);
}
std::uint64_t hash(int row) {
  return 18446744073709551557u - 1234567u * static_cast<unsigned>(row);
}

/// More rows than one block.
constexpr int kRows = 3000, kNumbers = 9;

class Tables : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string message = message_of([&] { TableWriter(file(), {"a"}).finish(); });
    if (message.find("built without HDF5") != std::string::npos) GTEST_SKIP() << message;
    EXPECT_EQ(message, "");
  }
  fs::path file() const { return folder_.path() / (std::string("t") + GetParam()); }
  static std::vector<Column> columns() {
    std::vector<Column> all{"time"};
    for (int i = 1; i < kNumbers; ++i)
      all.emplace_back("joint, \"" + std::to_string(i) + "\".\xc3\xa9");
    all.emplace_back("state_hash", CellType::kInteger);
    return all;
  }
  void write_rows(TableWriter& writer, int rows) const {
    for (int row = 0; row < rows; ++row) {
      for (int i = 0; i < kNumbers; ++i) {
        const double x = number(row, i);
        std::isnan(x) ? writer.empty() : writer.number(x);
      }
      writer.integer(hash(row));
      writer.end_row();
    }
  }
  void write_all() const {
    TableWriter writer(file(), columns());
    write_rows(writer, kRows);
    writer.finish();
  }
  void expect_rows(const fs::path& which, int least) const {
    TableReader reader(which);
    ASSERT_EQ(reader.num_columns(), kNumbers + 1);
    for (int i = 0; i <= kNumbers; ++i) EXPECT_EQ(reader.columns()[i].name, columns()[i].name);
    int rows = 0;
    for (; reader.next(); ++rows) {
      for (int i = 0; i < kNumbers; ++i) {
        const double expected = number(rows, i);
        if (std::isnan(expected))
          EXPECT_TRUE(std::isnan(reader.cell(i)));
        else
          ASSERT_EQ(std::bit_cast<std::uint64_t>(reader.cell(i)),
                    std::bit_cast<std::uint64_t>(expected));
      }
      ASSERT_EQ(reader.integer(kNumbers), hash(rows));
    }
    EXPECT_GE(rows, least);
    EXPECT_LE(rows, kRows);
  }
  test::TempFolder folder_;
};

TEST_P(Tables, GiveBackTheSameBits) {
  write_all();
  expect_rows(file(), kRows);
}

TEST_P(Tables, AreCopiedToCsvAndBackWithoutLoss) {
  write_all();
  const fs::path csv = folder_.path() / "copy.csv",
                 back = folder_.path() / (std::string("back") + GetParam());
  EXPECT_EQ(copy_table(file(), csv), kRows);
  EXPECT_EQ(copy_table(csv, back), kRows);
  expect_rows(back, kRows);
  EXPECT_TRUE(content(back) == content(file())) << "the same content, other bytes";
}

// No format may store the time of writing.
TEST_P(Tables, HaveTheSameBytesASecondLater) {
  write_all();
  const std::string before = content(file());
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  write_all();
  EXPECT_TRUE(content(file()) == before);
}

TEST_P(Tables, KeepAllRowsWhenAWriterIsLeftByAnException) {
  try {
    TableWriter writer(file(), columns());
    write_rows(writer, 10);
    writer.number(1.0);  // part of an unfinished row
    throw std::runtime_error("the run failed");
  } catch (const std::runtime_error&) {
  }
  TableReader reader(file());
  int rows = 0;
  while (reader.next()) ++rows;
  EXPECT_EQ(rows, 10);
}

TEST_P(Tables, OfAWriterThatDiedAreReadAsFarAsTheyGo) {
  TableWriter writer(file(), columns());
  write_rows(writer, kRows);
  // A process that dies leaves the file as it is on the disk during writing.
  const fs::path left = folder_.path() / (std::string("left") + GetParam());
  fs::copy_file(file(), left);
  const std::string name = GetParam();
  if (name == ".npz") {  // hashes are written at the end
    TableReader reader(left);
    EXPECT_EQ(reader.num_columns(), kNumbers);
    int rows = 0;
    for (; reader.next(); ++rows)
      ASSERT_TRUE(reader.cell(0) == number(rows, 0) || std::isnan(number(rows, 0)));
    EXPECT_GE(rows, kRows - 1000);
    return;
  }
  expect_rows(left, kRows - 1000);
}

TEST_P(Tables, SayLabelsByName) {
  const fs::path csv = folder_.path() / "labels.csv";
  {
    TableWriter writer(file(),
                       {"time", {"body", CellType::kLabel, {"left", "right, or \"so\""}}, "z"});
    for (const int label : {1, 0, 1}) {
      writer.number(0.5);
      writer.label(label);
      writer.number(2.0);
      writer.end_row();
    }
  }
  if (std::string(GetParam()) == ".csv") {
    fs::copy_file(file(), csv);
  } else {
    TableReader reader(file());
    ASSERT_TRUE(reader.next());
    EXPECT_EQ(reader.columns()[1].labels.size(), 2u);
    EXPECT_EQ(reader.cell(1), 1.0);
    copy_table(file(), csv);
  }
  TableReader again(csv, {"body"});  // CSV does not mark columns of names
  for (const char* name : {"right, or \"so\"", "left", "right, or \"so\""}) {
    ASSERT_TRUE(again.next());
    EXPECT_EQ(again.columns()[1].labels.at(static_cast<std::size_t>(again.cell(1))), name);
    EXPECT_EQ(again.cell(2), 2.0);
  }
  EXPECT_EQ(
      content(csv),
      "time,body,z\n0.5,\"right, or \"\"so\"\"\",2\n0.5,left,2\n0.5,\"right, or \"\"so\"\"\",2\n");
}

TEST_P(Tables, CutAnywhereAreRefusedOrShorter) {
  write_all();
  const std::string all = content(file());
  for (std::size_t size = 0; size < all.size(); size += 1 + all.size() / 97) {
    const fs::path cut = folder_.path() / (std::string("cut") + GetParam());
    std::ofstream(cut, std::ios::binary) << all.substr(0, size);
    try {
      TableReader reader(cut);
      int rows = 0;
      while (reader.next()) ++rows;
      EXPECT_LE(rows, kRows);
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("cut"), std::string::npos)
          << "does not name the file";
    }
  }
}

TEST_P(Tables, RefuseWhatIsNoNumberAndFoldersThatAreMissing) {
  {
    TableWriter writer(file(), {"time"});
    writer.number(std::numeric_limits<double>::infinity());
    writer.end_row();
  }
  EXPECT_NE(message_of([&] { Table(file()).cell(0, 0); }).find("no finite number"),
            std::string::npos);
  const fs::path nowhere = folder_.path() / "no" / (std::string("t") + GetParam());
  EXPECT_NE(message_of([&] { TableWriter writer(nowhere, {"a"}); }).find("cannot be created"),
            std::string::npos);
  EXPECT_NE(message_of([&] { Table table(nowhere); }).find("there is no such file"),
            std::string::npos);
  EXPECT_THROW(TableWriter(file(), {"a", "b"}).end_row(), std::logic_error);
}

INSTANTIATE_TEST_SUITE_P(Formats, Tables, testing::ValuesIn(kEndings),
                         [](const auto& ending) { return std::string(ending.param).substr(1); });

TEST(TableNames, SayTheFormat) {
  const test::TempFolder folder;
  const fs::path csv = folder.path() / "t.csv";
  TableWriter(csv, {"a"}).finish();
  for (const char* ending : {".npz", ".mcap"}) {
    const fs::path wrong = folder.path() / (std::string("wrong") + ending);
    fs::copy_file(csv, wrong);
    EXPECT_NE(message_of([&] { Table table(wrong); }).find("though its name ends"),
              std::string::npos);
    const fs::path right = folder.path() / (std::string("right") + ending),
                   other = folder.path() / "other.csv";
    TableWriter(right, {"a"}).finish();
    fs::copy_file(right, other, fs::copy_options::overwrite_existing);
    EXPECT_NE(
        message_of([&] { Table table(other); }).find(std::string("rename it to end in ") + ending),
        std::string::npos);
    EXPECT_NE(message_of([&] {
                TableWriter text(right, {{"name", CellType::kText}});
              }).find("only CSV"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace counterpoint::table_test
