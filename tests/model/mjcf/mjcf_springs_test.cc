// MJCF files: contacts whose solref has its negative form yield like springs.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_springs_test {
namespace {

constexpr double kRoundOff = 1e-14;  // relative, of a few operations

class MjcfSprings : public testing::Test {
 protected:
  Scene scene(const std::string& contents) {
    return load_scene(folder_.write("m.xml", "<mujoco>" + contents + "</mujoco>"));
  }
  /// A ball of 2 kg on a plane; `after`: further sections.
  Scene ball(const std::string& ball, const std::string& plane, const std::string& after = "") {
    return scene("<worldbody><geom name='g' type='plane' size='1 1 1' " + plane +
                 "/><body name='b'><freejoint/><geom name='s' size='0.1' mass='2' " + ball +
                 "/></body></worldbody>" + after);
  }
  static Material pair(const Scene& s, int a = 0, int b = 1) { return s.model.pair_material(a, b); }

  /// The stiffness s / ((1 - d) w), damping c / ((1 - d) w) of the solref (-s, -c).
  static void expect_spring(const Material& m, double s, double c, double d, double w) {
    EXPECT_NEAR(m.stiffness, s / ((1.0 - d) * w), kRoundOff * m.stiffness);
    EXPECT_NEAR(m.damping, c / ((1.0 - d) * w), kRoundOff * m.damping);
  }
  static int count_notes(const Scene& s, const std::string& text) {
    int count = 0;
    for (const Note& note : s.model.notes()) count += note.message.find(text) != std::string::npos;
    return count;
  }
  test::TempFolder folder_;
};

TEST_F(MjcfSprings, FollowFromTheImpedanceAndTheInverseMasses) {
  expect_spring(pair(ball("solref='-500 -20'", "")), 500, 20, 0.95, 0.5);
  expect_spring(pair(ball("", "solref='-500 -20' solimp='.8 .9'")), 500, 20, 0.925, 0.5);
  expect_spring(pair(ball("solref='-500 0'", "")), 500, 0, 0.95, 0.5);
  // MuJoCo bounds impedances by 0.9999.
  expect_spring(pair(ball("solref='-500 -20' solimp='1 1'", "solimp='1 1'")), 500, 20, 0.9999, 0.5);
  // Without a width the impedance is the mean of both.
  const Material flat = pair(ball("solref='-500 -20' solimp='.8 .9 0'", "solimp='.8 .9 0'"));
  const double ratio = 0.85 / 0.9;
  expect_spring(flat, 500 * ratio * ratio, 20 * ratio, 0.85, 0.5);
  const Scene two = scene(R"(<worldbody>
    <body pos='0 0 1'><freejoint/><geom size='0.1' mass='2' solref='-500 -20'/></body>
    <body pos='1 0 1'><freejoint/><geom size='0.1' mass='4'/></body></worldbody>)");
  expect_spring(pair(two), 500, 20, 0.95, 0.5 + 0.25);
  EXPECT_EQ(count_notes(two, "pairs of geoms that yield"), 1);
  EXPECT_FALSE(pair(ball("solref='0.01 1'", "solref='0.5 0.2'")).is_soft());
}

// MuJoCo takes the smaller numbers unless both surfaces have the positive form, solimp by solmix,
// and all of the geom with the higher priority.
TEST_F(MjcfSprings, CombineAsInMujoco) {
  expect_spring(pair(ball("solref='-50 -7' solimp='.9 .95 .003'",
                          "solref='-100 -3' solimp='.8 .9 .002' solmix='3'")),
                100, 7, 0.75 * 0.9 + 0.25 * 0.95, 0.5);
  expect_spring(pair(ball("solmix='0'", "solref='-100 -3' solimp='.8 .9'")), 100, 3, 0.9, 0.5);
  EXPECT_FALSE(pair(ball("priority='1'", "solref='-100 -3'")).is_soft());
  EXPECT_FALSE(pair(ball("solref='-100 -3'", "priority='1'")).is_soft());
  expect_spring(pair(ball("solref='-100 -3' solimp='.8 .9'  priority='1'", "solref='-200 -1'")),
                100, 3, 0.9, 0.5);
}

// A <pair> has parameters of its own, with MuJoCo's defaults, whatever those of its geoms.
TEST_F(MjcfSprings, PairsTakeNothingFromTheirGeoms) {
  const auto with = [&](const std::string& values) {
    return pair(ball("solref='-100 -3' friction='0.2 0.1' condim='4'", "friction='0.3'",
                     "<contact><pair geom1='g' geom2='s' " + values + "/></contact>"));
  };
  expect_spring(with("solref='-70 -5' solimp='.5 .6'"), 70, 5, 0.6, 0.5);
  const Material usual = with("");
  EXPECT_FALSE(usual.is_soft());
  EXPECT_EQ(usual.damping, 0.0);
  EXPECT_EQ(usual.friction, 1.0);
  EXPECT_EQ(usual.torsional_friction, 0.0);
}

// The edges of a friction pyramid carry the normal force together.
TEST_F(MjcfSprings, OfPyramidsDependOnFriction) {
  const auto k = [&](const std::string& option, const std::string& geom) {
    return pair(ball("solref='-100 -3' " + geom, "friction='0' condim='1'", option)).stiffness;
  };
  const double cone = 100 / ((1.0 - 0.95) * 0.5);
  const auto share = [](double f) { return 1.0 / (f * f * (1.0 + f * f)); };
  const std::string imp = "<option impratio='3'/>", elliptic = "<option cone='elliptic'/>";
  EXPECT_DOUBLE_EQ(k("", ""), cone);  // friction 1, condim 3: 2 / (1 + 1)
  EXPECT_DOUBLE_EQ(k("", "friction='0.5'"), cone * 2 * share(0.5));
  EXPECT_DOUBLE_EQ(k("", "friction='0.5' condim='1'"), cone);
  EXPECT_DOUBLE_EQ(k(imp, "friction='1.5' condim='6'"), cone * 5 * 3 * share(1.5));
  EXPECT_DOUBLE_EQ(k(elliptic, "friction='0.5' condim='4'"), cone);
  EXPECT_EQ(k("", "friction='0'"), INFINITY);  // 2e14 N/m
}

// A joint leaves one direction of three to the centre of mass.
TEST_F(MjcfSprings, UseTheMeanOverDirections) {
  const auto w = [&](const std::string& body) {
    const Material m =
        pair(scene("<worldbody><geom type='plane' size='1 1 1'/>" + body + "</worldbody>"));
    return 100 / (0.05 * m.stiffness);
  };
  const double inertia = 2 * 0.4 * 0.01;
  // Round-off of two mass matrices.
  EXPECT_NEAR(w("<body><joint type='slide'/><geom size='.1' mass='2' solref='-100 -3'/></body>"),
              1 / 6., 1e-14);
  EXPECT_NEAR(w("<body><joint/><geom size='.1' mass='2' pos='.3 0 0' solref='-100 -3'/></body>"),
              0.09 / (2 * 0.09 + inertia) / 3, 1e-14);
  // A slide along x with 3 kg and the armature 0.5 carries one along z with 2 kg.
  EXPECT_NEAR(w("<body><joint type='slide' axis='1 0 0' armature='0.5'/><geom size='.1' mass='3' "
                "contype='0' conaffinity='0'/><body><joint type='slide'/><geom size='.1' mass='2' "
                "solref='-100 -3'/></body></body>"),
              (1 / 5.5 + 1 / 2.) / 3, 1e-14);
}

TEST_F(MjcfSprings, YieldToOtherFilesAsToTheWorld) {
  folder_.write("ball.xml",
                "<mujoco><worldbody><body name='b'><freejoint/><geom size='0.1' mass='2' "
                "solref='-500 -20'/></body></worldbody></mujoco>");
  const Scene s =
      load_scene(folder_.write("s.yaml", "ground: {}\nmodels:\n  - {mjcf: ball.xml}\n"));
  ASSERT_EQ(s.model.geometries().size(), 2u);
  expect_spring(pair(s), 500, 20, 0.95, 0.5);
}

TEST_F(MjcfSprings, NoteWhatIsNotUsed) {
  EXPECT_EQ(count_notes(ball("solref='-500'", ""), "solref is not used"), 1);
  EXPECT_EQ(count_notes(ball("solref='0 -3'", ""), "solref is not used"), 1);
  EXPECT_EQ(count_notes(ball("", "solref='-5 -3'"), "find this surface hard"), 1);
  EXPECT_EQ(count_notes(ball("", "", "<option><flag override='enable'/></option>"),
                        "override is not obeyed"),
            1);
  // The centre of mass on the axle does not move: MuJoCo's contact is hard too.
  const Scene wheel = scene(
      "<worldbody><geom type='plane' size='1 1 1'/><body><joint axis='0 1 0'/>"
      "<geom size='.1' mass='2' solref='-100 -3'/></body></worldbody>");
  EXPECT_FALSE(pair(wheel).is_soft());
  EXPECT_EQ(count_notes(wheel, "are hard"), 1);
  const Scene usual = ball("", "");
  EXPECT_EQ(count_notes(usual, "negative solref: "), 0);
}

}  // namespace
}  // namespace counterpoint::mjcf_springs_test
