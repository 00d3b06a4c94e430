// TRC marker files read as tables, in the variants that programs write, and damaged ones.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"
#include "support/temp_folder.h"

namespace counterpoint::trc_test {
namespace {

class Trc : public testing::Test {
 protected:
  Table table(const std::string& text) const { return Table(folder_.write("t.trc", text)); }
  std::string refusal(const std::string& text) const {
    std::filesystem::remove(folder_.path() / "t.trc");  // some disks are slow to write over
    try {
      table(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  test::TempFolder folder_;
};

void expect_in(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find("t.trc:" + part), std::string::npos) << message;
}

/// The header of a file with two markers: "R.ASIS", "left knee".
std::string header(const std::string& units = "mm", const std::string& count = "2") {
  return "PathFileType\t4\t(X/Y/Z)\twalk.trc\n"
         "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\n"
         "60.00\t60.00\t       900\t" +
         count + "\t" + units +
         "\t60.00\n"
         "Frame#\tTime\tR.ASIS\t\t\tleft knee\t\t\t\n"
         "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

TEST_F(Trc, GivesMarkersInMetres) {
  const Table t = table(header() +
                        "\n258\t4.283\t594.248\t-10\t1e2\t1\t2\t3\t\n"
                        "259\t4.3\t+0.5\t0\t0\t0\t0\t0\t\n");
  EXPECT_EQ(t.columns(),
            (std::vector<std::string>{"frame", "time", "R.ASIS.x", "R.ASIS.y", "R.ASIS.z",
                                      "left knee.x", "left knee.y", "left knee.z"}));
  ASSERT_EQ(t.num_rows(), 2);
  const double first[] = {258.0, 4.283, 0.594248, -0.01, 0.1, 0.001, 0.002, 0.003};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(t.cell(0, i), i == 2 ? 594.248 / 1000.0 : first[i]) << i;
  EXPECT_EQ(t.cell(1, 2), 0.0005);
  EXPECT_EQ(t.cell(1, 3), 0.0);
  for (int i = 5; i < 8; ++i) EXPECT_TRUE(std::isnan(t.cell(1, i))) << "at zero: not seen";
  EXPECT_EQ(t.where(1), t.file() + ":8");
  EXPECT_EQ(t.where_columns(), t.file() + ":4");
  EXPECT_EQ(table(header("cm") + "1\t0\t50\t1\t1\t1\t1\t1\n").cell(0, 2), 0.5);
  EXPECT_EQ(table(header("m") + "1\t0\t50\t1\t1\t1\t1\t1\n").cell(0, 2), 50.0);
}

TEST_F(Trc, ReadsWhatDifferentProgramsWrite) {
  std::string text =
      header() + "1\t0\t\t\t\t1\t2\t3\n\n2\t0.5\t4\t5\t6\n3\t1\tnan\tNaN\tNAN\t1\t2\t3\n";
  std::string returns;
  for (const char c : text) returns += c == '\n' ? "\r\n" : std::string(1, c);
  for (const std::string& written : {text, returns}) {
    const Table t = table(written);
    ASSERT_EQ(t.num_rows(), 3);
    EXPECT_TRUE(std::isnan(t.cell(0, 2))) << "an empty cell";
    EXPECT_EQ(t.cell(0, 7), 0.003);
    EXPECT_EQ(t.cell(1, 4), 0.006);
    EXPECT_TRUE(std::isnan(t.cell(1, 5))) << "no cell";
    EXPECT_TRUE(std::isnan(t.cell(2, 3))) << "nan";
  }
  // Two tabs between values; names without the tabs of their columns; a repeated name.
  text = header() + "1\t0\t1\t2\t3\t4\t5\t6\n";
  text = replaced(text, "60.00\t60.00\t       900\t2\tmm\t60.00",
                  "60.00\t\t60.00\t\t900\t\t2\t\t mm\t60.00");
  EXPECT_EQ(table(text).cell(0, 7), 0.006);
  text = replaced(text, "R.ASIS\t\t\tleft knee\t\t\t", "knee\tknee");
  EXPECT_EQ(table(text).value(0, table(text).column("knee_2.z")), 0.006);
}

TEST_F(Trc, IsCopiedToCsvAndNotWritten) {
  const auto trc = folder_.write("t.trc", header() + "1\t0\t\t\t\t1\t2\t3\n");
  const auto csv = folder_.path() / "t.csv";
  EXPECT_EQ(copy_table(trc, csv), 1);
  const Table copy(csv);
  EXPECT_TRUE(std::isnan(copy.cell(0, 2)));
  EXPECT_EQ(copy.value(0, copy.column("left knee.z")), 0.003);
  try {
    copy_table(csv, trc);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("TRC files are read, not written"), std::string::npos);
  }
  std::filesystem::copy_file(trc, folder_.path() / "named.csv");
  try {
    Table table(folder_.path() / "named.csv");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("rename it to end in .trc"), std::string::npos);
  }
}

TEST_F(Trc, IsRefusedByLineWithWhatWasExpected) {
  const std::string row = "1\t0\t1\t2\t3\t4\t5\t6\n";
  EXPECT_NE(refusal("time,x\n0,1\n").find("no TRC file"), std::string::npos);
  expect_in(refusal(header("in") + row), "3: Units 'in'; expected mm, cm or m");
  expect_in(refusal(header("mm", "3") + row),
            "4: the names of 2 markers; line 3 says that there are 3");
  expect_in(refusal(header("mm", "two") + row), "4: the names of 2 markers; line 3 says");
  expect_in(refusal(replaced(header(), "NumMarkers", "Markers") + row),
            "3: no value of NumMarkers");
  expect_in(refusal(replaced(header(), "Frame#\tTime", "Frame#") + row),
            "4: the names of 1 markers");
  expect_in(refusal(replaced(header(), "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n", "") + row),
            "5: expected the names of the coordinates");
  expect_in(refusal("PathFileType\t4\n"), "2: the file ends; expected what line 3 holds");
  expect_in(refusal(header() + row + "2\t0\t1\t2\t3\t4\t5\t6\t7\n"),
            "7: 9 cells; frame, time and 2 markers have 8");
  expect_in(refusal(header() + "1\t0\t1\t2\t3\t4\t5\n"),
            "6: column 'left knee.x': the marker has 2 of");
  expect_in(refusal(header() + "1\t0\tone\t2\t3\n"),
            "6: column 'R.ASIS.x': 'one' is no finite number");
  expect_in(refusal(header() + "1\tinf\t1\t2\t3\n"), "6: column 'time': 'inf' is no finite number");
}

TEST_F(Trc, CutAnywhereIsReadOrRefused) {
  const std::string whole = header() + "\n258\t4.283\t594.248\t-10\t1e2\t1\t2\t3\t\n";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::string message = refusal(whole.substr(0, size));
    const bool has_line_5 = size + 30 > header().size();  // or a part of it
    EXPECT_TRUE(has_line_5 || !message.empty()) << size;
    EXPECT_TRUE(message.empty() || message.find("t.trc") != std::string::npos) << message;
  }
}

}  // namespace
}  // namespace counterpoint::trc_test
