// Actuators of MJCF files that have a command of their own, and limits of ball joints.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_actuators_test {
namespace {

class MjcfActuators : public testing::Test {
 protected:
  Model read(const std::string& sections, const std::string& joint = "<joint name='j'/>") {
    const auto file = folder_.write(
        "m.xml", "<mujoco><worldbody><site name='w' pos='1 0 0'/><body>" + joint +
                     "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
                     "<geom name='pad' size='0.1'/>"
                     "<site name='s' pos='0.1 0.2 0.3' euler='90 0 0'/></body></worldbody>" +
                     sections + "</mujoco>");
    return load_scene(file).model;
  }
  void expect_refused(const std::string& sections, const std::string& word) {
    try {
      read(sections);
      ADD_FAILURE() << "accepted; expected an error that names " << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
  test::TempFolder folder_;
};

TEST_F(MjcfActuators, APositionServoWithATimeConstantLags) {
  const Model m = read(
      "<actuator><position name='a' joint='j' kp='20' kv='3' timeconst='0.05' gear='2' "
      "ctrlrange='-1 1' forcerange='-4 4'/></actuator>");
  ASSERT_EQ(m.actuators().size(), 1u);
  const Actuator& a = m.actuators()[0];
  EXPECT_EQ(a.law, ActuatorLaw::kAffine);
  EXPECT_EQ(a.gear, 2.0);
  EXPECT_EQ(a.lag, 0.05);
  EXPECT_EQ(a.gain, 20.0);
  EXPECT_EQ(a.stiffness, 20.0);
  EXPECT_EQ(a.damping, 3.0);
  EXPECT_EQ(a.most_command, 1.0);
  EXPECT_EQ(a.least, -4.0);
  EXPECT_TRUE(m.servos().empty());
}

TEST_F(MjcfActuators, ACylinderPressesOnItsArea) {
  const Model m = read(
      "<actuator><cylinder name='a' joint='j' diameter='0.2' bias='1 -2 -3' timeconst='0.3'/>"
      "<cylinder name='b' joint='j' area='0.5'/></actuator>");
  const Actuator& a = m.actuators().at(0);
  EXPECT_NEAR(a.gain, 0.25 * 3.14159265358979323846 * 0.04, 1e-15);
  EXPECT_EQ(a.bias, 1.0);
  EXPECT_EQ(a.stiffness, 2.0);
  EXPECT_EQ(a.damping, 3.0);
  EXPECT_EQ(a.lag, 0.3);
  EXPECT_EQ(m.actuators().at(1).gain, 0.5);
}

TEST_F(MjcfActuators, AForceAtASiteIsAlongItsAxes) {
  const Model m =
      read("<actuator><motor name='a' site='s' gear='0 0 2 0 0 0.5' ctrlrange='0 7'/></actuator>");
  const Actuator& a = m.actuators().at(0);
  EXPECT_EQ(a.transmission, Transmission::kLink);
  EXPECT_LT((a.point - Vector3(0.1, 0.2, 0.3)).norm(), 1e-15);
  // The site is turned by 90 degrees about x: its z axis is -y of the body.
  EXPECT_LT((a.direction.force - Vector3(0, -2, 0)).norm(), 1e-12);
  EXPECT_LT((a.direction.torque - Vector3(0, -0.5, 0)).norm(), 1e-12);
  EXPECT_EQ(a.most_command, 7.0);
}

TEST_F(MjcfActuators, ThePidPluginIsReadFromItsInstance) {
  const std::string plugin =
      "<extension><plugin plugin='mujoco.pid'><instance name='i'><config key='kp' value='2'/>"
      "<config key='ki' value='3'/><config key='kd' value='0.1'/><config key='imax' value='0.5'/>"
      "<config key='slewmax' value='4'/></instance></plugin></extension>";
  const Model m =
      read(plugin +
           "<actuator><plugin name='a' plugin='mujoco.pid' instance='i' joint='j' actdim='2'/>"
           "</actuator>");
  const Actuator& a = m.actuators().at(0);
  EXPECT_EQ(a.law, ActuatorLaw::kPid);
  EXPECT_EQ(a.kp, 2.0);
  EXPECT_EQ(a.ki, 3.0);
  EXPECT_EQ(a.kd, 0.1);
  EXPECT_EQ(a.integral_limit, 0.5);
  EXPECT_EQ(a.slew, 4.0);
  EXPECT_EQ(a.num_states(), 2);
  expect_refused(
      "<actuator><plugin name='a' plugin='mujoco.pid' instance='k' joint='j'/>"
      "</actuator>",
      "no instance 'k'");
}

TEST_F(MjcfActuators, APidPluginKeepsItsFilter) {
  const auto sections = [](const std::string& dynamics, const std::string& more) {
    return "<extension><plugin plugin='mujoco.pid'/></extension><actuator>"
           "<plugin plugin='mujoco.pid' joint='j' dyntype='" +
           dynamics + "' dynprm='0.03' actdim='1'><config key='kp' value='2'/>" + more +
           "</plugin></actuator>";
  };
  EXPECT_EQ(read(sections("filterexact", "")).actuators().at(0).lag, 0.03);
  expect_refused(sections("integrator", ""), "integrator");
  expect_refused(sections("filterexact", "<config key='slewmax' value='1'/>"), "slewmax");
}

TEST_F(MjcfActuators, APidPluginOnAJointThatFollowsWithAnOffsetIsRefused) {
  const auto sections = [](const char* coefficients) {
    return std::string(
               "<extension><plugin plugin='mujoco.pid'/></extension><equality>"
               "<joint joint1='k' joint2='j' polycoef='") +
           coefficients +
           "'/></equality><actuator><plugin name='a' plugin='mujoco.pid' joint='k' gear='3'>"
           "<config key='kp' value='2'/></plugin></actuator>";
  };
  const std::string joints = "<joint name='j'/><joint name='k' axis='1 0 0'/>";
  const Model m = read(sections("0 2 0 0 0"), joints);
  EXPECT_EQ(m.actuators().at(0).joint, m.find_joint("j"));
  EXPECT_EQ(m.actuators().at(0).gear, 6.0);
  try {
    read(sections("0.5 2 0 0 0"), joints);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("'a'"), std::string::npos) << text;
    EXPECT_NE(text.find("adds 1.5 to the length"), std::string::npos) << text;
  }
}

TEST_F(MjcfActuators, AnIntegratedVelocityIsAServoOfTheIntegral) {
  const Model m =
      read("<actuator><intvelocity name='a' joint='j' kp='20' kv='3' actrange='-1 2'/></actuator>");
  const Actuator& a = m.actuators().at(0);
  EXPECT_TRUE(a.integrates);
  EXPECT_EQ(a.gain, 20.0);
  EXPECT_EQ(a.stiffness, 20.0);
  EXPECT_EQ(a.damping, 3.0);
  EXPECT_EQ(a.least_setpoint, -1.0);
  EXPECT_EQ(a.most_setpoint, 2.0);
  EXPECT_EQ(a.num_states(), 1);
}

TEST_F(MjcfActuators, ADamperIsScaledByItsCommand) {
  const Model m = read("<actuator><damper name='a' joint='j' kv='3' ctrlrange='0 2'/></actuator>");
  const Actuator& a = m.actuators().at(0);
  EXPECT_EQ(a.command_damping, 3.0);
  EXPECT_EQ(a.gain, 0.0);
  EXPECT_EQ(a.damping, 0.0);
  EXPECT_EQ(a.most_command, 2.0);
  const Model classed = read(
      "<default><default class='c'><damper kv='5' ctrlrange='0 1'/></default></default>"
      "<actuator><damper name='a' joint='j' class='c'/></actuator>");
  EXPECT_EQ(classed.actuators().at(0).command_damping, 5.0);
  expect_refused("<actuator><damper name='a' joint='j' kv='3' ctrlrange='-1 2'/></actuator>",
                 "from 0 on");
}

TEST_F(MjcfActuators, SensorsReadTendonsAndActuators) {
  const Model m = read(
      "<tendon><fixed name='t'><joint joint='j' coef='2'/></fixed>"
      "<spatial name='s'><site site='w'/><site site='s'/></spatial></tendon>"
      "<actuator><motor name='a' tendon='s' gear='3'/>"
      "<position name='b' joint='j' timeconst='0.1'/></actuator>"
      "<sensor><tendonpos tendon='s'/><tendonvel tendon='s'/><actuatorfrc actuator='b'/>"
      "<actuatorpos actuator='b'/><touch site='s'/></sensor>");
  ASSERT_EQ(m.sensors().size(), 5u) << (m.notes().empty() ? "" : m.notes().back().message);
  using enum SensorKind;
  const SensorKind kinds[] = {kTendonLength, kTendonVelocity, kActuatorForce, kActuatorPosition,
                              kTouch};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(m.sensors()[i].kinds.at(0), kinds[i]);
  EXPECT_EQ(m.sensors()[0].tendon, m.find_tendon("s"));
  EXPECT_EQ(m.sensors()[2].actuator, m.find_actuator("b"));
  EXPECT_EQ(m.sensors()[4].geometries.size(), 1u);
}

TEST_F(MjcfActuators, AdhesionAttractsByItsBody) {
  const auto file = folder_.write(
      "a.xml",
      "<mujoco><worldbody><body name='b'><freejoint/><geom size='0.1'/></body></worldbody>"
      "<actuator><adhesion name='a' body='b' gain='30' ctrlrange='0 1'/></actuator></mujoco>");
  const Model m = load_scene(file).model;
  const Actuator& a = m.actuators().at(0);
  EXPECT_EQ(a.transmission, Transmission::kAdhesion);
  EXPECT_EQ(a.gain, 30.0);
  EXPECT_EQ(a.most_command, 1.0);
}

TEST_F(MjcfActuators, ARangeOfABallJointBoundsItsAngle) {
  const Model m = read("", "<joint name='j' type='ball' limited='true' range='0 45'/>");
  EXPECT_NEAR(m.joint(0).upper, 0.25 * 3.14159265358979323846, 1e-12);
  EXPECT_FALSE(std::isfinite(m.joint(0).lower));
}

}  // namespace
}  // namespace counterpoint::mjcf_actuators_test
