// MJCF files: tendons over joints that are not coupled and through space, actuators on them, and
// springs given by their motion.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_tendons_test {
namespace {

constexpr double kRoundOff = 1e-14;

class MjcfTendons : public testing::Test {
 protected:
  Scene scene(const std::string& sections) {
    return load_scene(folder_.write("m.xml", "<mujoco>" + bodies_ + sections + "</mujoco>"));
  }
  std::string refusal(const std::string& sections) {
    try {
      scene(sections);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  static const Tendon& tendon(const Scene& s, const char* name) {
    return s.model.tendons().at(static_cast<size_t>(s.model.find_tendon(name)));
  }
  /// Two hinges with balls of 1 kg at 1 m; sites at both balls, on the world, and around a cylinder
  /// of radius 0.2 m at the first ball.
  const std::string bodies_ = R"(<worldbody><site name='w' pos='0 0 2'/>
    <body name='l1'><joint name='j1' axis='0 1 0'/><geom name='g1' size='0.1' pos='1 0 0' mass='1'/>
      <geom name='c' type='cylinder' size='0.2 0.1' pos='1 0 0' euler='90 0 0' mass='0'/>
      <site name='s1' pos='1 0 0.5'/><site name='over' pos='1.5 0 0'/>
      <site name='inside' pos='1.1 0 0'/></body>
    <body name='l2' pos='0 3 0'><joint name='j2' axis='0 1 0' ref='10'/>
      <geom name='g2' size='0.1' pos='1 0 0' mass='1'/><site name='s2' pos='1 0 -0.5'/></body>
    </worldbody>)";
  test::TempFolder folder_;
};

TEST_F(MjcfTendons, SumsOfJointsThatAreNotCoupled) {
  const Scene s = scene(R"(<tendon><fixed name='t' range='-0.5 0.25' stiffness='6' damping='2'
      frictionloss='3' springlength='0.1 0.2'><joint joint='j1' coef='0.5'/>
      <joint joint='j2' coef='-2'/></fixed></tendon>
    <actuator><position tendon='t' kp='10' kv='4' gear='3' ctrlrange='-1 1' forcerange='-5 7'/>
    </actuator><keyframe><key ctrl='0.9'/></keyframe>)");
  const Tendon& t = tendon(s, "t");
  ASSERT_EQ(t.joints.size(), 2u);
  EXPECT_EQ(t.joints[1].coefficient, -2.0);
  EXPECT_EQ(t.stiffness, 6.0);
  EXPECT_EQ(t.damping, 2.0);
  EXPECT_EQ(t.dry_friction, 3.0);
  EXPECT_EQ(std::pair(t.rest_shortest, t.rest_longest), std::pair(0.1, 0.2));
  EXPECT_EQ(std::pair(t.lower, t.upper), std::pair(-0.5, 0.25));
  // The actuator's force kp (u - g L) - kv g dL/dt acts g times on the tendon.
  EXPECT_NEAR(t.servo.stiffness, 90.0, kRoundOff);
  EXPECT_NEAR(t.servo.damping, 36.0, kRoundOff);
  EXPECT_NEAR(t.servo.target, 0.9 / 3.0, kRoundOff);
  EXPECT_EQ(std::pair(t.servo.least, t.servo.most), std::pair(-15.0, 21.0));
}

/// The rest length is that in the reference pose, whatever the pose at the start. The far side of
/// the cylinder is that of the sidesite.
TEST_F(MjcfTendons, PathsAroundACylinder) {
  const Scene s = scene(R"(<tendon>
      <spatial name='straight' stiffness='5'><site site='w'/><site site='s1'/></spatial>
      <spatial name='around' range='0 9'><site site='s1'/><geom geom='c' sidesite='over'/>
        <site site='s2'/></spatial>
      <spatial name='block'><site site='w'/><site site='s1'/><pulley divisor='2'/><site site='w'/>
        <site site='s1'/></spatial></tendon><keyframe><key qpos='1 0'/></keyframe>)");
  const double straight = std::hypot(1.0, 1.5);
  EXPECT_NEAR(tendon(s, "straight").rest_longest, straight, kRoundOff);
  VectorX q = s.model.default_q();
  EXPECT_EQ(q[0], 1.0);
  q << 0.0, 10.0 * M_PI / 180.0;
  const std::vector<Pose> at = body_poses(s.model, q);
  const auto length = [&](const char* name) {
    return tendon_length(s.model, tendon(s, name), q, at);
  };
  EXPECT_NEAR(length("straight"), straight, kRoundOff);
  EXPECT_NEAR(length("block"), 1.5 * straight, kRoundOff);
  // Both ends are 0.5 m above and below the middle, 3 m apart along the axis.
  const double flat = 2.0 * std::sqrt(0.25 - 0.04) + 0.2 * (M_PI - 2.0 * std::acos(0.4));
  EXPECT_NEAR(length("around"), std::hypot(flat, 3.0), kRoundOff);
}

TEST_F(MjcfTendons, OneThatIsNoPathIsRefusedByLine) {
  const auto with = [&](const std::string& path) {
    return refusal("\n<tendon><spatial name='t'>" + path + "</spatial></tendon>");
  };
  EXPECT_NE(with("<site site='w'/><site site='none'/>").find("no site 'none'"), std::string::npos);
  EXPECT_NE(with("<site site='w'/><geom geom='g1'/>").find("between two points"),
            std::string::npos);
  EXPECT_NE(with("<site site='w'/><geom geom='c' sidesite='inside'/><site site='s2'/>")
                .find("inside the radius"),
            std::string::npos);
  EXPECT_NE(with("<site site='w'/><geom geom='c' sidesite='w'/><site site='s2'/>")
                .find("body of the geom"),
            std::string::npos);
}

/// A ball of 1 kg at 1 m with its own 2/5 m r^2: stiffness I / (T z)^2, damping 2 I / T.
TEST_F(MjcfTendons, SpringDamperIsThatOfTheMotion) {
  const Scene s = load_scene(folder_.write("s.xml", R"(<mujoco><worldbody><body>
      <joint name='j' axis='0 1 0' springdamper='0.1 0.5'/>
      <geom size='0.1' pos='1 0 0' mass='1'/></body></worldbody></mujoco>)"));
  const double inertia = 1.0 + 0.4 * 0.01;
  ASSERT_EQ(s.model.springs().size(), 1u);
  EXPECT_NEAR(s.model.springs()[0].stiffness, inertia / 0.0025, 1e-10);
  EXPECT_NEAR(s.model.damping()[0], 2.0 * inertia / 0.1, 1e-12);
}

}  // namespace
}  // namespace counterpoint::mjcf_tendons_test
