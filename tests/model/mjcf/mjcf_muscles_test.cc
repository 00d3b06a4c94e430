// Muscles of MJCF files: the parameters that MuJoCo derives from their attributes.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/mjcf/document/defaults.h"
#include "counterpoint/model/mjcf/forces/muscles.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_muscles_test {
namespace {

constexpr double kRoundOff = 1e-14;

class MjcfMusclesTest : public testing::Test {
 protected:
  /// Reads the last element of <actuator> as a muscle at the joint `j`, or at a tendon of these
  /// limits. The other elements are defaults.
  std::optional<Muscle> read(const std::string& contents, double gear = 1.0,
                             const TendonSpec* tendon = nullptr, double offset = 0.0) {
    const auto file = folder_.write("m.xml", "<mujoco>" + contents + "</mujoco>");
    const MjcfOptions options;
    mjcf::Document document(file, options);
    const mjcf::Defaults defaults(document);
    const auto elements = document.section_children("actuator");
    auto levels = defaults.chain(*elements.back(), "", {"general", "muscle"});
    levels.push_back(elements.back());
    const MjcfModel model = load_mjcf(folder_.write("body.xml", body_));
    const auto muscle = mjcf::read_muscle(
        document, levels, {tendon ? nullptr : &model.robot.joints[0], tendon, gear, offset}, model);
    faults_.clear();
    try {
      document.faults.throw_if_any();
    } catch (const InputError& error) {
      faults_ = error.what();
    }
    return muscle;
  }
  void expect_error(const std::string& contents, const std::string& word) {
    try {
      read(contents);
      ADD_FAILURE() << "accepted; expected an error that names " << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
  /// A ball of 2 kg, 0.5 m from a hinge with limits, and one of 1 kg on a hinge at the first ball.
  const std::string body_ = R"(<mujoco><compiler angle='radian'/><worldbody>
    <body><joint name='j' axis='0 1 0' range='-0.5 1.5'/>
      <inertial pos='0.5 0 0' mass='2' diaginertia='0.01 0.01 0.01'/>
      <body pos='0.5 0 0'><joint name='k' axis='0 1 0'/>
        <inertial pos='0.25 0 0' mass='1' diaginertia='0.01 0.01 0.01'/></body>
    </body></worldbody></mujoco>)";
  std::string faults_;
  test::TempFolder folder_;
};

TEST_F(MjcfMusclesTest, DefaultsAreThoseOfMujoco) {
  const auto m = read("<actuator><muscle joint='j' force='300' lengthrange='0.1 0.4'/></actuator>");
  ASSERT_TRUE(m) << faults_;
  EXPECT_EQ(m->curves, Muscle::Curves::kMujoco);
  EXPECT_EQ(m->max_force, 300.0);
  EXPECT_NEAR(m->optimal_length, 0.3 / (1.05 - 0.75), kRoundOff);
  EXPECT_NEAR(m->slack_length, 0.1 - 0.75 * m->optimal_length, kRoundOff);
  EXPECT_EQ(m->max_speed, 1.5);
  EXPECT_EQ(m->shortest, 0.5);
  EXPECT_EQ(m->longest, 1.6);
  EXPECT_EQ(m->passive_force, 1.3);
  EXPECT_EQ(m->eccentric_force, 1.2);
  EXPECT_EQ(m->activation_time, 0.01);
  EXPECT_EQ(m->deactivation_time, 0.04);
  EXPECT_EQ(m->activation_smoothing, 0.0);
}

TEST_F(MjcfMusclesTest, AttributesOverrideDefaultClasses) {
  const auto m = read(R"(<default><muscle force='300' vmax='8' lmin='0.4' timeconst='0.02 0.06'/>
    <default class='weak'><muscle force='100' fpmax='0.7' tausmooth='0.1'/></default></default>
    <actuator><muscle class='weak' joint='j' range='0.6 1.2' lengthrange='1 4' lmax='1.8'
                      fvmax='1.5' fpmax='0.9' scale='7'/></actuator>)");
  ASSERT_TRUE(m) << faults_;
  EXPECT_EQ(m->max_force, 100.0);
  EXPECT_NEAR(m->optimal_length, 3.0 / (1.2 - 0.6), kRoundOff);
  EXPECT_NEAR(m->slack_length, 1.0 - 0.6 * m->optimal_length, kRoundOff);
  EXPECT_EQ(m->max_speed, 8.0);
  EXPECT_EQ(m->shortest, 0.4);
  EXPECT_EQ(m->longest, 1.8);
  EXPECT_EQ(m->passive_force, 0.9);
  EXPECT_EQ(m->eccentric_force, 1.5);
  EXPECT_EQ(m->activation_time, 0.02);
  EXPECT_EQ(m->deactivation_time, 0.06);
  EXPECT_EQ(m->activation_smoothing, 0.1);
}

TEST_F(MjcfMusclesTest, AGeneralActuatorIsTheSameMuscle) {
  const auto general = read(R"(<default><general dyntype='muscle' gaintype='muscle'
      biastype='muscle' dynprm='0.02 0.06' gainprm='0.6 1.2 90 200 0.4 1.8 8 0.9 1.5'/></default>
    <actuator><general joint='j' lengthrange='1 4' biasprm='0.6 1.2 90 200 0.4 1.8 8 0.9 1.5'/>
    </actuator>)");
  const auto muscle = read(R"(<actuator><muscle joint='j' lengthrange='1 4' timeconst='0.02 0.06'
      range='0.6 1.2' force='90' lmin='0.4' lmax='1.8' vmax='8' fpmax='0.9' fvmax='1.5'/></actuator>)");
  ASSERT_TRUE(general && muscle) << faults_;
  for (const double length : {0.5, 1.5, 2.0, 3.5, 6.0}) {
    for (const double speed : {-10.0, 0.0, 10.0})
      EXPECT_EQ(muscle_force(*general, 0.4, length, speed).force,
                muscle_force(*muscle, 0.4, length, speed).force);
  }
  EXPECT_EQ(general->activation_time, 0.02);
  EXPECT_EQ(general->deactivation_time, 0.06);
}

TEST_F(MjcfMusclesTest, WithoutABiasThereIsNoPassiveForce) {
  const auto m = read(R"(<actuator><general joint='j' dyntype='muscle' gaintype='muscle'
    lengthrange='1 4' dynprm='0.02 0.06' gainprm='0.6 1.2 90 200 0.4 1.8 8 0.9 1.5'/></actuator>)");
  ASSERT_TRUE(m) << faults_;
  EXPECT_EQ(m->passive_force, 0.0);
}

TEST_F(MjcfMusclesTest, LengthsFollowFromLimits) {
  const std::string muscle = "<actuator><muscle joint='j' force='300' range='0.5 1.5'/></actuator>";
  const auto at_joint = read(muscle, -0.1);  // lengths of -0.15 ... 0.05
  ASSERT_TRUE(at_joint) << faults_;
  EXPECT_NEAR(at_joint->optimal_length, 0.2, kRoundOff);
  EXPECT_NEAR(at_joint->slack_length, -0.15 - 0.5 * 0.2, kRoundOff);
  // An offset moves the lengths of MuJoCo, not the force at a coordinate.
  EXPECT_NEAR(read(muscle, -0.1, nullptr, 7.0)->slack_length, at_joint->slack_length, kRoundOff);
  TendonSpec tendon;
  tendon.lower = 0.3;
  tendon.upper = 0.5;
  const auto on_tendon = read(muscle, 1.0, &tendon);
  ASSERT_TRUE(on_tendon) << faults_;
  EXPECT_NEAR(on_tendon->optimal_length, 0.2, kRoundOff);
  tendon.upper = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(read(muscle, 1.0, &tendon));
  EXPECT_NE(faults_.find("lengthrange"), std::string::npos) << faults_;
}

// The mass matrix by hand: inertias about the hinges with the balls in a line.
TEST_F(MjcfMusclesTest, ANegativeForceIsScaledByTheAccelerationOfTheReferencePose) {
  const double outer = 0.01 + 0.0625, both = outer + 0.5 * 0.25;
  const double inner = 0.01 + 2 * 0.25 + 0.01 + 0.75 * 0.75;
  const double determinant = inner * outer - both * both;
  const double acceleration = 2.0 * std::hypot(outer, both) / determinant;  // the gear is 2
  const auto m = read("<actuator><muscle joint='j' scale='50'/></actuator>", 2.0);
  ASSERT_TRUE(m) << faults_;
  EXPECT_NEAR(m->max_force, 50.0 / acceleration, 1e-12);
  TendonSpec tendon;
  tendon.lower = 0.3;
  tendon.upper = 0.5;
  EXPECT_FALSE(read("<actuator><muscle tendon='t'/></actuator>", 1.0, &tendon));
  EXPECT_NE(faults_.find("positive force"), std::string::npos) << faults_;
}

TEST_F(MjcfMusclesTest, AFileBecomesAModelWithMuscles) {
  std::string file = body_;
  file.insert(file.find("</mujoco>"), R"(<tendon><fixed name='t'><joint joint='j' coef='0.1'/>
      <joint joint='k' coef='-0.05'/></fixed></tendon>
    <default><muscle force='200' ctrllimited='true' ctrlrange='0 0.9'/></default>
    <actuator><muscle name='short' joint='j' gear='-0.1'/>
      <muscle name='long' tendon='t' lengthrange='-0.1 0.2' force='150' scale='1' tausmooth='0.1'
        timeconst='0.02 0.05' range='0.7 1.0' lmin='0.4' lmax='1.7' vmax='2' fpmax='1' fvmax='1.3'/>
    </actuator>)");
  const Scene scene = load_scene(folder_.write("muscles.xml", file));
  ASSERT_EQ(scene.model.actuators().size(), 2u);
  const Actuator& at_joint = scene.model.actuators()[0];
  EXPECT_EQ(at_joint.law, ActuatorLaw::kMuscle);
  EXPECT_EQ(at_joint.transmission, Transmission::kJoint);
  EXPECT_EQ(at_joint.gear, -0.1);
  EXPECT_EQ(at_joint.most_command, 0.9);
  EXPECT_NEAR(at_joint.muscle.optimal_length, 0.2 / 0.3, kRoundOff);
  const Actuator& on_tendon = scene.model.actuators()[1];
  EXPECT_EQ(on_tendon.transmission, Transmission::kTendon);
  EXPECT_EQ(on_tendon.muscle.max_force, 150.0);
  EXPECT_NEAR(on_tendon.muscle.optimal_length, 0.3 / 0.3, kRoundOff);
}

TEST_F(MjcfMusclesTest, AMuscleAtASiteIsRefused) {
  std::string file = body_;
  file.insert(file.find("</mujoco>"), "<actuator><muscle site='s' force='1'/></actuator>");
  file.insert(file.find("<body>"), "<site name='s'/>");
  try {
    load_scene(folder_.write("site.xml", file));
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("joint or a tendon"), std::string::npos)
        << error.what();
  }
}

TEST_F(MjcfMusclesTest, WrongNumbersAreNamed) {
  const auto muscle = [](const std::string& attributes) {
    return "<actuator><muscle joint='j' lengthrange='1 2' " + attributes + "/></actuator>";
  };
  expect_error(muscle("range='1 0.5'"), "range");
  expect_error(muscle("timeconst='0 0.1'"), "timeconst");
  expect_error(muscle("tausmooth='-1'"), "tausmooth");
  expect_error(muscle("lmin='1.2'"), "lmin");
  expect_error(muscle("lmax='0.9'"), "lmax");
  expect_error(muscle("vmax='-1'"), "vmax");
  expect_error(muscle("fvmax='1'"), "fvmax");
  expect_error(muscle("fpmax='-1'"), "fpmax");
  expect_error("<actuator><muscle joint='j' lengthrange='2 1'/></actuator>", "lengthrange");
  read(R"(<actuator><general joint='j' lengthrange='1 2' biastype='muscle' dynprm='1 1'
    gainprm='0.6 1.2 90 200 0.4 1.8 8 0.9 1.5' biasprm='0.6 1.2 80 200 0.4 1.8 8 0.9 1.5'/></actuator>)");
  EXPECT_NE(faults_.find("biasprm"), std::string::npos) << faults_;
}

}  // namespace
}  // namespace counterpoint::mjcf_muscles_test
