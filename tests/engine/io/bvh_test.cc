// BVH skeletons read as tables: known answers of forward kinematics, variants, damaged files.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"
#include "support/temp_folder.h"

namespace counterpoint::bvh_test {
namespace {

/// Rounding of a few products of numbers of order one, with cos(90 degrees) = 6e-17.
constexpr double kRounding = 1e-14;

class Bvh : public testing::Test {
 protected:
  Table table(const std::string& text) const {
    TableOptions options;
    options.any_unit = true;
    return Table(folder_.write("t.bvh", text), {}, options);
  }
  std::string refusal(const std::string& text) const {
    try {
      table(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  test::TempFolder folder_;
};

std::string skeleton(const std::string& channels = "Zrotation Xrotation Yrotation") {
  return "HIERARCHY\n"
         "ROOT Hips\n"
         "{\n"
         "  OFFSET 1 2 3\n"
         "  CHANNELS 6 Xposition Yposition Zposition " +
         channels +
         "\n"
         "  JOINT Left Leg\n"
         "  {\n"
         "    OFFSET 0 0 1\n"
         "    CHANNELS 1 Xrotation\n"
         "    End Site\n"
         "    {\n"
         "      OFFSET 0 2 0\n"
         "    }\n"
         "  }\n"
         "}\n";
}

std::string motion(const std::string& rows, int count = 1) {
  return "MOTION\nFrames: " + std::to_string(count) + "\nFrame Time: 0.25\n" + rows;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

Vector3 place(const Table& t, int row, const std::string& name) {
  return {t.cell(row, t.column(name + ".x")), t.cell(row, t.column(name + ".y")),
          t.cell(row, t.column(name + ".z"))};
}

Matrix3 turn(const Table& t, const std::string& name) {
  return Quaternion(t.cell(0, t.column(name + ".qw")), t.cell(0, t.column(name + ".qx")),
                    t.cell(0, t.column(name + ".qy")), t.cell(0, t.column(name + ".qz")))
      .toRotationMatrix();
}

Matrix3 about(const Vector3& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * std::acos(-1.0) / 180.0, axis).toRotationMatrix();
}

// Rotations apply in the order of the channels, about axes that turn: a quarter turn about z and
// then one about the new x takes z to x; x before z takes it to -y. Positions replace offsets.
TEST_F(Bvh, JointsArePlacedByForwardKinematics) {
  const Table t = table(skeleton() + motion("10 20 30 90 90 0 90\n5 6 7 0 0 0 0\n", 2));
  ASSERT_EQ(t.num_rows(), 2);
  EXPECT_EQ(t.num_columns(), 1 + 7 + 7 + 3);
  EXPECT_EQ(t.cell(1, t.column("time")), 0.25);
  EXPECT_EQ(place(t, 0, "Hips"), Vector3(10, 20, 30));
  EXPECT_LT((place(t, 0, "Left Leg") - Vector3(11, 20, 30)).norm(), 30 * kRounding);
  // The leg turns its end's offset from 2 y to 2 z, which the hips turn to 2 x.
  EXPECT_LT((place(t, 0, "Left Leg.end") - Vector3(13, 20, 30)).norm(), 30 * kRounding);
  EXPECT_EQ(place(t, 1, "Left Leg.end"), Vector3(5, 8, 8));
  EXPECT_EQ(t.where(1), t.file() + ":20");
  const Table other =
      table(skeleton("Xrotation Zrotation Yrotation") + motion("0 0 0 90 90 0 0\n"));
  EXPECT_LT((place(other, 0, "Left Leg") - Vector3(0, -1, 0)).norm(), kRounding);
}

// Every order of channels is the product of its rotations, and the child's follows its parent's.
TEST_F(Bvh, OrientationsAreProductsInTheOrderOfTheChannels) {
  const std::string axes[] = {"X", "Y", "Z"};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (i == j) continue;
      const int k = 3 - i - j;
      const Table t =
          table(skeleton(axes[i] + "rotation " + axes[j] + "rotation " + axes[k] + "rotation") +
                motion("0 0 0 20 -50 170 33\n"));
      const Matrix3 hips =
          about(Vector3::Unit(i), 20) * about(Vector3::Unit(j), -50) * about(Vector3::Unit(k), 170);
      EXPECT_LT((turn(t, "Hips") - hips).norm(), kRounding);
      EXPECT_LT((turn(t, "Left Leg") - hips * about(Vector3::UnitX(), 33)).norm(), kRounding);
    }
}

TEST_F(Bvh, JointsBelowTheRootMayMove) {
  const std::string text =
      replaced(skeleton(), "CHANNELS 1 Xrotation", "CHANNELS 2 Yposition Xrotation");
  EXPECT_EQ(place(table(text + motion("0 0 0 0 0 0 4 0\n")), 0, "Left Leg"), Vector3(0, 4, 1));
}

TEST_F(Bvh, VariantsOfProgramsGiveTheSameTable) {
  const std::string rows = "10 20 30 90 90 0 90\n";
  const Table plain = table(skeleton() + motion(rows));
  std::string returns, tabs;
  for (const char c : skeleton() + motion(rows)) {
    returns += c == '\n' ? "\r\n" : std::string(1, c);
    tabs += c == ' ' ? "\t" : std::string(1, c);
  }
  tabs = replaced(replaced(tabs, "Left\tLeg", "Left Leg"), "Frame\tTime", "Frame Time");
  for (const std::string& text :
       {returns, tabs, replaced(skeleton(), "Hips\n{", "Hips {\n") + motion("\n" + rows + "\n\n"),
        skeleton() + motion("10 2e1 +30.0 90 90 -0 90")}) {
    const Table t = table(text);
    ASSERT_EQ(t.columns(), plain.columns());
    ASSERT_EQ(t.num_rows(), 1);
    for (int i = 0; i < t.num_columns(); ++i) EXPECT_EQ(t.cell(0, i), plain.cell(0, i)) << i;
  }
  const std::string tips = "End Site\n{\nOFFSET 0 0 4\n}\n}\n}\n";
  EXPECT_EQ(place(table(replaced(skeleton(), "  }\n}\n", tips) + motion("0 0 0 0 0 0 0\n")), 0,
                  "Left Leg.end_2"),
            Vector3(0, 0, 5))
      << "two ends of a limb";
  const std::string second = replaced(skeleton(), "HIERARCHY\n", "");
  const Table two =
      table(skeleton() + replaced(replaced(second, "Hips", "Box"), "Left Leg", "Lid") +
            motion("1 2 3 0 0 0 0 4 5 6 0 0 0 0\n"));
  EXPECT_EQ(place(two, 0, "Box"), Vector3(4, 5, 6)) << "a second root";
}

// A chain of 10 000 joints is read without recursion: its end is as far away as it has links.
TEST_F(Bvh, DeepNestingNeedsNoStack) {
  constexpr int kDepth = 10'000;
  std::string text = "HIERARCHY\nROOT j0\n{\nOFFSET 0 0 0\nCHANNELS 1 Zrotation\n";
  for (int i = 1; i < kDepth; ++i)
    text += "JOINT j" + std::to_string(i) + "\n{\nOFFSET 1 0 0\nCHANNELS 0\n";
  for (int i = 0; i < kDepth; ++i) text += "}\n";
  const Table t = table(text + motion("0\n"));
  EXPECT_EQ(place(t, 0, "j" + std::to_string(kDepth - 1)), Vector3(kDepth - 1, 0, 0));
}

TEST_F(Bvh, IsRefusedByLineWithWhatWasExpected) {
  const std::string rows = motion("0 0 0 0 0 0 0\n"), all = skeleton() + rows;
  const struct {
    std::string text, expected;
  } cases[] = {
      {"HIERARCHY x\n", "t.bvh:1: 'HIERARCHY x'; expected HIERARCHY"},
      {replaced(all, "ROOT Hips", "JOINT Hips"), "t.bvh:2: JOINT; expected ROOT outside"},
      {replaced(all, "ROOT Hips", "ROOT"), "t.bvh:2: 'ROOT'; expected the joint's name"},
      {replaced(all, "ROOT Hips\n{", "ROOT Hips\n["), "t.bvh:3: '['; expected {"},
      {replaced(all, "OFFSET 1 2 3", "OFFSET 1 2"), "t.bvh:4: 'OFFSET 1 2'; expected OFFSET and"},
      {replaced(all, "OFFSET 1 2 3", "OFFSET 1 nan 3"), "t.bvh:4: OFFSET 'nan'; expected a number"},
      {replaced(all, "OFFSET 1 2 3", "OFFSET 1 1e300 3"), "t.bvh:4: OFFSET '1e300'; expected"},
      {replaced(all, "OFFSET 1 2 3\n", "\n"), "t.bvh:6: expected OFFSET and CHANNELS of 'Hips'"},
      {replaced(all, "OFFSET 0 2 0\n", "\n"), "t.bvh:13: } of 'Left Leg.end' (line 10)"},
      {replaced(all, "Zposition", "Wposition"), "t.bvh:5: channel 'Wposition'; expected one of"},
      {replaced(all, "Zposition", "Xposition"), "t.bvh:5: a second channel Xposition"},
      {replaced(all, "CHANNELS 6", "CHANNELS 5"), "t.bvh:5: 'CHANNELS 5 Xpos"},
      {replaced(all, "JOINT Left Leg", "JOINT Hips"), "t.bvh:6: a second 'Hips'"},
      {replaced(all, "End Site", "End"), "t.bvh:10: 'End'; expected End Site"},
      {replaced(all, "      OFFSET 0 2 0", "CHANNELS 1 Xrotation"), "t.bvh:12: CHANNELS of an End"},
      {replaced(all, "}\nMOTION", "MOTION"), "t.bvh:15: MOTION; expected } of 'Hips'"},
      {replaced(all, "}\nMOTION", "}\n}\nMOTION"), "t.bvh:16: '}' outside of a joint"},
      {"HIERARCHY\n" + rows, "t.bvh:2: MOTION; expected ROOT before it"},
      {replaced(all, "Frames: 1", "Frames: 0"), "t.bvh:17: Frames: '0'; expected a whole number"},
      {replaced(all, "Frames: 1", "Frames: 1.5"), "t.bvh:17: Frames: '1.5'; expected a whole"},
      {replaced(all, "Frames: 1", "Frame 1"), "t.bvh:17: 'Frame 1'; expected Frames:"},
      {replaced(all, "Frames: 1", "Frames: 1000000"), "t.bvh:20: the file ends after 1 of 1000000"},
      {replaced(all, "0.25", "0"), "t.bvh:18: Frame Time: expected a time above 0"},
      {replaced(all, "0.25", "inf"), "t.bvh:18: Frame Time: 'inf'; expected a number"},
      {all + "0 0 0 0 0 0 0\n", "t.bvh:20: a line after the last of 1 frames"},
      {skeleton() + motion("0 0 0 0 0 0\n"),
       "t.bvh:19: 6 values; the channels of all joints are 7"},
      {skeleton() + motion("0 0 0 0 x 0 0\n"), "t.bvh:19: channel value 'x'; expected a number"},
      {skeleton() + motion("0 0 0 0 NaN 0 0\n"), "t.bvh:19: channel value 'NaN'"},
      {replaced(skeleton(), "1 Xrotation", "3 Xposition Yposition Zposition") +
           motion("0 0 0 0 0 0 0 0 0\n"),
       "t.bvh:19: position 0 0 0 of 'Left Leg', though its OFFSET is not"},
  };
  for (const auto& c : cases)
    EXPECT_NE(refusal(c.text).find(c.expected), std::string::npos)
        << c.expected << "\n got: " << refusal(c.text);
  try {
    Table unknown(folder_.write("t.bvh", all));
    ADD_FAILURE() << "lengths of an unknown unit were read";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("only `retarget` reads them"), std::string::npos);
  }
}

TEST_F(Bvh, CutAnywhereIsRefusedUnlessItIsWhole) {
  const std::string whole = skeleton() + motion("0 0 0 0 0 0 7\n");
  for (std::size_t size = 0; size < whole.size() - 2; ++size) {
    const std::string message = refusal(whole.substr(0, size));
    EXPECT_NE(message.find("t.bvh"), std::string::npos) << size << message;
  }
  EXPECT_EQ(refusal(whole), "");
}

}  // namespace
}  // namespace counterpoint::bvh_test
