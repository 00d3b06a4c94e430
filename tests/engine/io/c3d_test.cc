// C3D files, built byte by byte, read as tables: numbers of every processor, points that were not
// seen, analog channels, more frames and names than the format first had room for, damaged files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/io/c3d_parameters.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"
#include "engine/io/c3d_file.h"
#include "support/temp_folder.h"

namespace counterpoint::c3d_test {
namespace {

constexpr int kPoint = 1, kAnalog = 2, kTrial = 3;  // group numbers
constexpr double kNotSeen = -1.0;                   // residual

class C3d : public testing::Test {
 protected:
  Table table(const test::C3dFile& file) const {
    return Table(folder_.write("t.c3d", file.bytes()));
  }
  std::string refusal(const std::string& bytes) const {
    std::filesystem::remove(folder_.path() / "refused.c3d");  // some disks are slow to write over
    try {
      Table table(folder_.write("refused.c3d", bytes));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string refusal(const test::C3dFile& file) const { return refusal(file.bytes()); }
  test::TempFolder folder_;
};

void expect_in(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_NE(message.find("refused.c3d: "), std::string::npos) << message;
}

/// One point "M" in `frames` frames, at (frame, 1, 2) mm.
test::C3dFile one_point(int frames = 1) {
  test::C3dFile file;
  file.points = 1;
  file.last = frames;
  file.group(kPoint, "POINT");
  file.text(kPoint, "UNITS", "mm");
  file.texts(kPoint, "LABELS", {"M"}, 4);
  for (int i = 0; i < frames; ++i) file.point(1.0 + i, 1.0, 2.0);
  return file;
}

/// Two points, two channels of two samples, two frames. The second point is not seen in one frame
/// and at zero in the other. All numbers are exact in every format.
test::C3dFile two_frames(int processor, bool reals) {
  test::C3dFile file;
  file.processor = processor;
  file.reals = reals;
  file.points = file.channels = file.samples = 2;
  file.first = 7;
  file.last = 8;
  file.rate = 50.0;
  file.group(kPoint, "POINT");
  file.words(kPoint, "USED", {2});
  file.reals_of(kPoint, "RATE", {50.0});
  file.reals_of(kPoint, "SCALE", {reals ? -0.5 : 0.5});
  file.text(kPoint, "UNITS", "mm  ");
  file.texts(kPoint, "LABELS", {"left knee", "M2"}, 12);
  file.words(kAnalog, "USED", {2});  // precedes its group
  file.group(kAnalog, "Analog");
  file.texts(kAnalog, "LABELS", {"Fz", "emg"}, 4);
  file.reals_of(kAnalog, "GEN_SCALE", {2.0});
  file.reals_of(kAnalog, "SCALE", {0.25, -1.0});
  file.words(kAnalog, "OFFSET", {100, -3});
  file.point(100.0, -250.5, 1000.0).point(3.0, 4.0, 5.0, kNotSeen);
  file.value(101).value(5).value(103).value(6);
  file.point(-100.0, 0.0, 0.5).point(0.0, 0.0, 0.0);
  file.value(-100).value(-3).value(-100).value(-3);
  return file;
}

TEST(C3dNumbers, AreTheKnownOnesOfEveryProcessor) {
  const auto real = [](C3dProcessor processor, std::string_view bytes) {
    return c3d_real(processor, bytes, 0);
  };
  using std::string_view;
  EXPECT_EQ(real(C3dProcessor::kIntel, string_view("\x00\x00\x80\x3f", 4)), 1.0);
  EXPECT_EQ(real(C3dProcessor::kMips, string_view("\x3f\x80\x00\x00", 4)), 1.0);
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\x80\x40\x00\x00", 4)), 1.0);
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\x60\xc1\x00\x00", 4)), -3.5);
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\x49\x41\xdb\x0f", 4)), 0x1.921fb6p1);  // pi
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\x00\x00\x00\x00", 4)), 0.0);
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\xff\x7f\xff\xff", 4)), 0x1.fffffep126);
  EXPECT_EQ(real(C3dProcessor::kDec, string_view("\x80\x00\x00\x00", 4)), 0x1p-128);
  EXPECT_TRUE(std::isnan(real(C3dProcessor::kDec, string_view("\x00\x80\x00\x00", 4))));
  EXPECT_EQ(c3d_word(C3dProcessor::kIntel, string_view("\x02\x01", 2), 0), 0x102);
  EXPECT_EQ(c3d_word(C3dProcessor::kMips, string_view("\x02\x01", 2), 0), 0x201);
}

TEST_F(C3d, GivesTheSameTableOfEveryProcessor) {
  for (const int processor : {84, 85, 86})
    for (const bool reals : {false, true}) {
      SCOPED_TRACE(testing::Message() << "processor " << processor << ", reals " << reals);
      const Table t = table(two_frames(processor, reals));
      EXPECT_EQ(t.columns(),
                (std::vector<std::string>{"frame", "time", "left knee.x", "left knee.y",
                                          "left knee.z", "M2.x", "M2.y", "M2.z", "Fz", "emg"}));
      ASSERT_EQ(t.num_rows(), 2);
      // The doubles nearest to these decimals: one division of an exact number by 1000.
      const double first[] = {7.0, 0.0, 0.1, -0.2505, 1.0},
                   second[] = {8.0, 0.02, -0.1, 0.0, 0.0005};
      for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(t.cell(0, i), first[i]) << i;
        EXPECT_EQ(t.cell(1, i), second[i]) << i;
      }
      for (int i = 5; i < 8; ++i) {
        EXPECT_TRUE(std::isnan(t.cell(0, i))) << "a residual below zero";
        EXPECT_TRUE(std::isnan(t.cell(1, i))) << "at zero";
      }
      EXPECT_EQ(t.cell(0, 8), (102.0 - 100.0) * 0.5);
      EXPECT_EQ(t.cell(0, 9), (5.5 + 3.0) * -2.0);
      EXPECT_EQ(t.cell(1, 8), (-100.0 - 100.0) * 0.5);
      EXPECT_EQ(t.cell(1, 9), 0.0);
    }
}

TEST_F(C3d, IsCopiedToCsv) {
  const auto csv = folder_.path() / "t.csv";
  EXPECT_EQ(copy_table(folder_.write("t.c3d", two_frames(85, false).bytes()), csv), 2);
  const Table copy(csv);
  EXPECT_EQ(copy.value(1, copy.column("left knee.z")), 0.0005);
  EXPECT_TRUE(std::isnan(copy.cell(1, copy.column("M2.x"))));
}

TEST_F(C3d, HasMoreFramesThanAHeaderCounts) {
  const int count = 70'000;
  test::C3dFile file = one_point();
  file.reals = false;
  file.frames.clear();
  for (int i = 0; i < count; ++i) file.point(1 + i % 1000, 1.0, 2.0);
  file.last = 65'535;
  EXPECT_EQ(table(file).num_rows(), count) << "to the end of the file";
  test::C3dFile trial = file;
  trial.group(kTrial, "TRIAL");
  trial.words(kTrial, "ACTUAL_START_FIELD", {2, 1});  // two words, the lower first
  trial.words(kTrial, "ACTUAL_END_FIELD", {(65'538 + count - 1) % 65'536, 2});
  trial.last = count - 65'536;  // modulo 65536, as some programs write it
  const Table t = table(trial);
  EXPECT_EQ(t.num_rows(), count);
  EXPECT_EQ(t.cell(0, 0), 65'538.0);
  file.reals_of(kPoint, "LONG_FRAMES", {69'999.0});
  EXPECT_EQ(table(file).num_rows(), 69'999);
  const double time = table(file).cell(69'998, 1);
  EXPECT_EQ(time, 69'998 / 100.0);
}

TEST_F(C3d, DoesNotTakePaddingForFrames) {
  test::C3dFile file = one_point();
  file.reals = false;
  file.frames.clear();
  for (int i = 0; i < 65'535; ++i) file.point(1.0, 1.0, 2.0);
  file.last = 65'535;
  file.frames.resize(file.frames.size() + 511);
  EXPECT_EQ(table(file).num_rows(), 65'535);
}

TEST_F(C3d, NamesMorePointsAndChannelsThanAListHolds) {
  test::C3dFile file;
  file.points = file.channels = 300;
  file.group(kPoint, "POINT");
  file.group(kAnalog, "ANALOG");
  file.text(kPoint, "UNITS", "m");
  std::vector<std::string> labels, more;
  for (int i = 0; i < 255; ++i) labels.push_back(fmt::format("P{}", i));
  for (int i = 255; i < 299; ++i) more.push_back(fmt::format("P{}", i));
  for (const int group : {kPoint, kAnalog}) {
    file.texts(group, "LABELS", labels, 4);
    file.texts(group, "LABELS2", more, 4);
  }
  file.reals_of(kAnalog, "SCALE", std::vector<double>(255, 1.0));
  file.reals_of(kAnalog, "SCALE2", std::vector<double>(45, 4.0));
  for (int i = 0; i < 300; ++i) file.point(i + 1.0, 1.0, 1.0);
  for (int i = 0; i < 300; ++i) file.value(i);
  const Table t = table(file);
  EXPECT_EQ(t.value(0, t.column("P298.x")), 299.0);
  EXPECT_EQ(t.value(0, t.column("marker300.x")), 300.0);
  EXPECT_EQ(t.value(0, t.column("P254")), 254.0);
  EXPECT_EQ(t.value(0, t.column("P255")), 4.0 * 255.0);
  EXPECT_EQ(t.value(0, t.column("channel300")), 4.0 * 299.0);
}

TEST_F(C3d, MakesNamesDifferThatAreNot) {
  test::C3dFile file;
  file.points = 3;
  file.channels = 4;
  file.group(kPoint, "POINT");
  file.group(kAnalog, "ANALOG");
  file.text(kPoint, "UNITS", "m");
  file.texts(kPoint, "LABELS", {"A", "A", std::string("B\0x", 2)}, 2);
  file.texts(kAnalog, "LABELS", {"time", "Fz", "Fz", "A.x"}, 4);
  for (int i = 0; i < 3; ++i) file.point(1.0, 1.0, 1.0);
  for (int i = 0; i < 4; ++i) file.value(1.0);
  EXPECT_EQ(
      table(file).columns(),
      (std::vector<std::string>{"frame", "time", "A.x", "A.y", "A.z", "A_2.x", "A_2.y", "A_2.z",
                                "B.x", "B.y", "B.z", "analog.time", "Fz", "Fz_2", "analog.A.x"}));
}

TEST_F(C3d, ConvertsEveryPointsUnitAndLeavesResultsOfModels) {
  test::C3dFile file;
  file.points = 3;
  file.group(kPoint, "POINT");
  file.texts(kPoint, "UNITS", {"cm", "m", "deg"}, 3);
  file.texts(kPoint, "LABELS", {"A", "B", "KneeAngles"}, 10);
  file.texts(kPoint, "ANGLES", {"KneeAngles"}, 10);
  file.point(150.0, 1.0, 1.0).point(1.5, 1.0, 1.0).point(0.0, 0.0, 0.0);
  const Table t = table(file);
  EXPECT_EQ(t.value(0, t.column("A.x")), 1.5);
  EXPECT_EQ(t.value(0, t.column("B.x")), 1.5);
  EXPECT_EQ(t.value(0, t.column("KneeAngles.x")), 0.0) << "an angle may be zero";
}

TEST_F(C3d, ReadsChannelsAloneAndSamplesWithoutASign) {
  test::C3dFile file;
  file.reals = false;
  file.channels = 1;
  file.samples = 2;
  file.rate = 60.0;
  file.last = 2;
  file.group(kAnalog, "ANALOG");
  file.text(kAnalog, "FORMAT", "UNSIGNED");
  file.words(kAnalog, "OFFSET", {32768});
  file.value(32768).value(65535).value(0).value(0);
  const Table t = table(file);
  EXPECT_EQ(t.value(0, t.column("channel1")), 32767.0 / 2.0);
  EXPECT_EQ(t.value(1, t.column("channel1")), -32768.0);
  EXPECT_EQ(t.value(1, t.column("time")), 1.0 / 60.0) << "the header's rate";
}

TEST_F(C3d, RefusesWhatItCannotTellByFileAndByte) {
  test::C3dFile file = one_point(2);
  std::string bytes = file.bytes();
  expect_in(refusal("t,x\n0,1\n"),
            "byte 0: expected the header of 512 bytes; the file ends at byte 8");
  expect_in(refusal(std::string(600, 'x')), "no C3D file");
  expect_in(
      refusal(bytes.substr(0, bytes.size() - 1)),
      "byte 1024: expected frames 1 to 2 of 16 bytes each; the file ends at byte 1055, after 1");
  bytes[515] = 83;
  expect_in(refusal(bytes), "byte 515: processor type 83; expected 84 (Intel)");
  bytes = file.bytes();
  bytes[16] = 2;
  expect_in(refusal(bytes), "byte 16: the data begin at block 2; expected a block after");
  bytes[16] = 100;
  expect_in(refusal(bytes), "byte 0: expected header and parameters of 50688 bytes");

  test::C3dFile other = file;
  other.words(kPoint, "USED", {2});
  expect_in(refusal(other), "byte 2: the header says 1, POINT:USED says 2; expected the same");
  other = file;
  other.reals_of(kPoint, "RATE", {0.0});
  other.rate = 0.0;
  expect_in(refusal(other), "byte 20: 0 frames a second (POINT:RATE)");
  other = file;
  other.first = 3;
  expect_in(refusal(other), "byte 6: frames 3 to 2");
  other = test::C3dFile();
  expect_in(refusal(other), "byte 2: neither points nor analog samples");
  other.channels = 3;
  other.group(kAnalog, "ANALOG");
  other.words(kAnalog, "USED", {2});
  expect_in(refusal(other), "byte 4: 3 analog samples a frame; expected as many of each of the 2");
  other = file;
  other.record(kPoint, "LONG", {'\x04', 2, '\xff', '\xff'});
  expect_in(refusal(other), "goes beyond the data's begin, byte 1024");
}

TEST_F(C3d, RefusesUnitsThatItDoesNotKnow) {
  test::C3dFile file;
  file.points = 1;
  file.point(1.0, 1.0, 1.0);
  expect_in(refusal(file), "POINT:UNITS '' of point 1; expected mm, cm or m");
  file.group(kPoint, "POINT");
  file.text(kPoint, "UNITS", "in");
  expect_in(refusal(file), "POINT:UNITS 'in' of point 1; expected mm, cm or m");
}

TEST_F(C3d, IsNotWritten) {
  const auto file = folder_.path() / "out.c3d";
  try {
    TableWriter writer(file, {"time"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("C3D files are read, not written"), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(C3d, CutOrDamagedAnywhereIsReadOrRefused) {
  for (const int processor : {84, 85, 86}) {
    const std::string whole = two_frames(processor, processor != 86).bytes();
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_NE(refusal(whole.substr(0, size)), "") << size << " bytes of " << whole.size();
    for (std::size_t i = 0; i < whole.size(); ++i) {
      if (i > 30 && i < 512) continue;  // bytes that are not read
      for (const int bits : {0x01, 0x80, 0xff}) {
        std::string damaged = whole;
        damaged[i] = static_cast<char>(damaged[i] ^ bits);
        const std::string message = refusal(damaged);  // must not crash, nor take all memory
        if (!message.empty()) expect_in(message, "refused.c3d");
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::c3d_test
