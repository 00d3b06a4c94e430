// MJCF files with soft contacts: their depth at rest against weight over stiffness, and against
// MuJoCo.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "apps/command.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "peers/mujoco.h"
#include "peers/mujoco_file.h"

namespace counterpoint::mjcf_springs_test {
namespace {

const std::string kGround = "<geom name='g' type='plane' size='1 1 1'/>";
// A constant impedance: MuJoCo's contacts are springs at every depth.
const std::string kConstant =
    "<default><geom solimp='0.95 0.95 0.001'/><pair solimp='0.95 0.95 0.001'/></default>";
const std::string kCone = "<option timestep='0.001' cone='elliptic'/>";

class MjcfSprings : public ::testing::Test {
 protected:
  std::string write(const std::string& sections, const std::string& bodies) const {
    folder_.write("m.xml", "<mujoco>" + sections + "<worldbody>" + kGround + bodies +
                               "</worldbody></mujoco>");
    return folder_.path("m.xml");
  }
  /// Poses of the bodies [m] after `seconds`.
  static std::vector<Pose> play(const std::string& file, double seconds) {
    const Scene scene = load_scene(file);
    Simulator sim(scene);
    for (long i = std::lround(seconds / scene.options.time_step); i > 0; --i)
      EXPECT_TRUE(sim.step().succeeded());
    Data data(scene.model);
    compute_poses(scene.model, sim.state().q, data);
    return data.X_WB;
  }
  test::CommandFolder folder_{"mjcf_springs"};
};

constexpr double kRest = 4.0;  // [s]: motion decays by exp(-8 t) or faster

TEST_F(MjcfSprings, YieldByTheLoadOverTheStiffness) {
  constexpr double k = 100 / (0.05 * 0.5), weight = 2 * 9.81;
  // The smoothing of the contact law lifts a point by less, since the dampers are weak.
  constexpr double kRelative = 1e-9;
  const auto depth = [&](const std::string& geom) {
    const std::string body = "<body pos='0 0 .1'><freejoint/><geom mass='2' " + geom + "/></body>";
    return 0.1 - play(write(kCone, body), kRest)[1].translation.z();
  };
  EXPECT_NEAR(depth("size='.1' solref='-100 -1'"), weight / k, kRelative * weight / k);
  EXPECT_NEAR(depth("type='box' size='.2 .1 .1' solref='-100 -0.2'"), weight / (4 * k),
              kRelative * weight / (4 * k));
}

class MjcfSpringsAndMujoco : public MjcfSprings {
 protected:
  void SetUp() override {
    if (peers::mujoco_version().empty()) GTEST_SKIP() << "MuJoCo was not found when this was built";
  }
};

TEST_F(MjcfSpringsAndMujoco, RestWhereMujocosDo) {
  // The smoothing of the contact law lifts a point by up to 2e-9 m/s c / k, here 3e-7 of the depth;
  // MuJoCo's solver stops short of 1e-8.
  constexpr double kRelative = 1e-6;
  const auto free = [](const std::string& shape, const std::string& values) {
    return fmt::format("<body pos='0 0 .1'><freejoint/><geom name='s' mass='2' {} {}/></body>",
                       shape, values);
  };
  const std::string ball = "size='.1'", box = "type='box' size='.2 .1 .1'", h = " timestep='0.001'";
  const std::string soft = "solref='-5000 -100' ", constant = kConstant + kCone;
  struct Case {
    const char* name;
    std::string sections, bodies;
  };
  for (const Case& c : {
           Case{"ball", constant, free(ball, soft)},
           Case{"box", constant, free(box, soft)},
           Case{"pyramid", kConstant + "<option impratio='2'" + h + "/>",
                free(box, soft + "friction='0.5'")},
           Case{"condim 4", kConstant + "<option" + h + "/>",
                free(ball, soft + "friction='1.5' condim='4' priority='1'")},
           Case{"condim 1", kConstant + "<option" + h + "/>",
                free(ball, soft + "friction='0.5' condim='1' priority='1'")},
           Case{"beyond the width", kCone, free(ball, "solref='-100 -10'")},
           Case{"no width", kCone + "<default><geom solimp='.8 .9 0'/></default>",
                free(ball, "solref='-1000 -50'")},
           Case{"priority", constant, free(box, soft + "solimp='.7 .7' priority='1'")},
           Case{"pair",
                constant + "<contact><pair geom1='s' geom2='g' solref='-800 -40'/></contact>",
                free(box, soft)},
           Case{"tower", constant,
                free(box, soft + "solimp='.9 .9' solmix='2'") +
                    "<body pos='0 0 .3'><freejoint/><geom size='.1' mass='3' "
                    "solref='-4000 -120' solimp='.8 .8'/></body>"},
           Case{"arm", constant,
                "<body pos='0 0 .4'><joint axis='0 1 0' damping='1'/>"
                "<geom type='capsule' fromto='0 0 0 .4 0 0' size='.02'/><body pos='.4 0 0'>"
                "<joint axis='0 1 0' damping='1' stiffness='50'/>"
                "<geom type='capsule' fromto='0 0 0 .1 0 -.3' size='.02'/><geom size='.05' "
                "pos='.1 0 -.35' solref='-3000 -100' condim='1' priority='1'/></body></body>"},
       }) {
    SCOPED_TRACE(c.name);
    const std::string file = write(c.sections, c.bodies);
    const std::vector<Pose> ours = play(file, kRest), theirs = peers::play_mjcf(file, kRest);
    ASSERT_EQ(ours.size(), theirs.size());
    const std::vector<Pose> start = play(file, 0.0);
    const std::size_t last = ours.size() - 1;
    const double depth = (theirs[last].translation - start[last].translation).norm();
    const double error = (ours[last].translation - theirs[last].translation).norm();
    EXPECT_LT(error, kRelative * depth);
  }
}

// With strong dampers both sink by 1 - exp(-t s / c) of their depth at rest. The inertia that
// MuJoCo adds, and the masses, change the rate and delay the start by shares s / c^2.
TEST_F(MjcfSpringsAndMujoco, SinkAsFastAsMujocosDo) {
  constexpr double s = 2500.0, c = 1000.0, seconds = 0.4;
  const std::string file = write(
      kConstant + "<option timestep='0.0001' cone='elliptic'/>",
      fmt::format("<body pos='0 0 .1'><freejoint/><geom size='.1' mass='2' solref='{} {}'/></body>",
                  -s, -c));
  const double rest = 9.81 * 0.05 / s, sunk = rest * (1.0 - std::exp(-seconds * s / c));
  const double tolerance = 2.0 * s / (c * c) * rest;
  EXPECT_NEAR(0.1 - play(file, seconds)[1].translation.z(), sunk, tolerance);
  EXPECT_NEAR(0.1 - peers::play_mjcf(file, seconds)[1].translation.z(), sunk, tolerance);
}

// Without gravity and damper both are springs in a quarter of a period at 1 m/s: ours is that of
// the body's mass, and MuJoCo's that of its mass over 1 - d.
TEST_F(MjcfSpringsAndMujoco, ImpactsAreShorterThanMujocos) {
  constexpr double s = 5000.0, h = 1e-5;
  for (const double d : {0.5, 0.95}) {
    const std::string file = write(
        fmt::format("<default><geom solimp='{} {} 0.001'/></default><option timestep='{}' "
                    "gravity='0 0 0' cone='elliptic'/><keyframe><key qpos='0 0 .1 1 0 0 0' "
                    "qvel='0 0 -1 0 0 0'/></keyframe>",
                    d, d, h),
        fmt::format(
            "<body pos='0 0 .1'><freejoint/><geom size='.1' mass='2' solref='{} 0'/></body>", -s));
    const double theirs = 1.0 / std::sqrt(s), ours = theirs * std::sqrt(1.0 - d);
    constexpr double kQuarter = 1.5707963267948966;
    // The way of three steps at 1 m/s [m]: contact begins within a step, and both rules err by
    // about half a step.
    const double tolerance = 3.0 * h;
    EXPECT_NEAR(0.1 - play(file, kQuarter * ours)[1].translation.z(), ours, tolerance);
    EXPECT_NEAR(0.1 - peers::play_mjcf(file, kQuarter * theirs)[1].translation.z(), theirs,
                tolerance);
  }
}

}  // namespace
}  // namespace counterpoint::mjcf_springs_test
