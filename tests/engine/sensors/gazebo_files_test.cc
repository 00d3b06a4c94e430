// Sensors and motors of Gazebo in SDF files and in a URDF's <gazebo>, with answers by hand.
#include <gtest/gtest.h>

#include "engine/sensors/sensed.h"
#include "support/temp_folder.h"

namespace counterpoint::gazebo_files_test {
namespace {

using test::Sensed;

constexpr double kWeight = 2.0 * 9.8;  // weight of the bob [N]
/// Rounding of sines and of a step from rest, times forces of 20 N.
constexpr double kRounding = 1e-10;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

Matrix3 about_x(double angle) { return Matrix3(Eigen::AngleAxisd(angle, Vector3::UnitX())); }
Matrix3 about_y(double angle) { return Matrix3(Eigen::AngleAxisd(angle, Vector3::UnitY())); }

class GazeboFiles : public testing::Test {
 protected:
  void SetUp() override {
    try {
      load_scene(
          write("any.sdf", "<sdf version='1.9'><model name='m'><link name='l'/></model></sdf>"));
    } catch (const InputError& error) {
      if (std::string(error.what()).find("built without SDF") == std::string::npos) throw;
      GTEST_SKIP() << error.what();
    }
  }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    return folder_.write(name, text);
  }
  Scene load(const std::string& name, const std::string& text) {
    return load_scene(write(name, text));
  }
  std::string error_of(const std::string& name, const std::string& text) {
    try {
      load(name, text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

 private:
  test::TempFolder folder_;
};

std::string notes_of(const Scene& scene) {
  std::string all;
  for (const Note& note : scene.model.notes()) all += note.where + ": " + note.message + "\n";
  return all;
}

void expect_parts(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

// A bob under a hinge about y; the base, the bob, the joint frame and the sensor are turned by
// different angles. The centre of mass is 0.1 m beside the hinge's origin and right below it at the
// angle kAngle, so that the bob rests there.
constexpr double kAngle = 0.4;

constexpr const char* kHanging = R"(<sdf version='1.9'><world name='w'><gravity>0 0 -9.8</gravity>
  <model name='m'>
  <link name='base'><pose>0 0 2 0 0.3 0</pose></link>
  <link name='bob'><pose>0 0 2 0 0.5 0</pose><inertial><pose>CENTER 0 0 0</pose><mass>2</mass>
    <inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial></link>
  <joint name='fix' type='fixed'><parent>world</parent><child>base</child></joint>
  <joint name='hinge' type='revolute'><pose>0 0 0 0 0.1 0</pose>JOINT
    <axis><xyz>0 1 0</xyz></axis>
    <sensor name='meter' type='force_torque'><pose>0 0 0 0.7 0 0</pose><force_torque>
      <frame>FRAME</frame><measure_direction>DIRECTION</measure_direction></force_torque></sensor>
  </joint></model></world></sdf>)";

TEST_F(GazeboFiles, AForceTorqueSensorReadsAHangingMassInEachFrameAndDirection) {
  for (const bool reversed : {false, true})
    for (const std::string frame : {"parent", "child", "sensor"})
      for (const std::string direction : {"child_to_parent", "parent_to_child"}) {
        SCOPED_TRACE(frame + " " + direction + (reversed ? " of a joint that points inward" : ""));
        const double bob = 0.5 + (reversed ? -kAngle : kAngle);  // angle of the bob in the world
        const Vector3 center = about_y(-bob) * Vector3(0, 0.1, -0.6);
        std::string text = replaced(kHanging, "FRAME", frame);
        text = replaced(text, "DIRECTION", direction);
        text = replaced(text, "CENTER",
                        std::to_string(center.x()) + " 0.1 " + std::to_string(center.z()));
        text = replaced(text, "JOINT",
                        reversed ? "<parent>bob</parent><child>base</child>"
                                 : "<parent>base</parent><child>bob</child>");
        Scene scene = load("hanging.sdf", text);
        scene.q[0] = kAngle;
        Sensed run(std::move(scene));
        run.step();
        // Forces of the bob on the base: its weight, and the moment of that about the hinge.
        Vector3 force(0, 0, -kWeight), torque(-0.1 * kWeight, 0, 0);
        if ((direction == "child_to_parent") == reversed) force = -force, torque = -torque;
        const Matrix3 R_WB = about_y(0.3), R_WM = about_y(bob);
        const Matrix3 R_WP = reversed ? R_WM : R_WB, R_WC = reversed ? R_WB : R_WM;
        const Matrix3 R_WS = frame == "parent"  ? R_WP
                             : frame == "child" ? R_WC
                                                : Matrix3(R_WC * about_y(0.1) * about_x(0.7));
        // The file has six digits of the centre: 1e-6 m times the weight.
        constexpr double kDigits = 1e-6 * kWeight * 10;
        EXPECT_LE((run.vector("m/hinge/meter.fx") - R_WS.transpose() * force).norm(), kDigits);
        EXPECT_LE((run.vector("m/hinge/meter.tx") - R_WS.transpose() * torque).norm(), kDigits);
      }
}

TEST_F(GazeboFiles, ATorqueIsAboutTheOriginOfTheJointWhichMovesWithTheChild) {
  for (const std::string frame : {"parent", "child"}) {
    Scene scene = load("slider.sdf", replaced(R"(<sdf version='1.9'><model name='m'>
  <link name='rail'><pose>0 0 2 0 0 1.5707963267948966</pose></link>
  <link name='cart'><inertial><pose>0 0.1 0 0 0 0</pose><mass>2</mass></inertial>
    <pose>0 0 2 0 0 0</pose></link>
  <joint name='fix' type='fixed'><parent>world</parent><child>rail</child></joint>
  <joint name='slide' type='prismatic'><parent>rail</parent><child>cart</child>
    <axis><xyz>1 0 0</xyz></axis><sensor name='s' type='force_torque'><force_torque>
    <frame>FRAME</frame></force_torque></sensor></joint></model></sdf>)",
                                              "FRAME", frame));
    scene.q[0] = 0.3;
    const double weight = 2.0 * -scene.model.gravity().z();
    Sensed run(std::move(scene));
    run.step();
    // The rail's x axis is y of the world: the moment about -x of the world is one about y of the
    // rail.
    const Vector3 torque =
        frame == "parent" ? Vector3(0, 0.1 * weight, 0) : Vector3(-0.1 * weight, 0, 0);
    EXPECT_LE((run.vector("slide/s.fx") - Vector3(0, 0, -weight)).norm(), kRounding);
    EXPECT_LE((run.vector("slide/s.tx") - torque).norm(), kRounding) << run.vector("slide/s.tx");
  }
}

constexpr const char* kRobot = R"(<robot name='r'>
  <link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0'
    iyz='0'/></inertial></link>
  <link name='arm'><inertial><origin xyz='0 0 -0.5'/><mass value='1.5'/><inertia ixx='0.1' iyy='0.1'
    izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
  <link name='tool'><inertial><mass value='0.5'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0'
    ixz='0' iyz='0'/></inertial>
    <collision><origin xyz='0 0 -0.1'/><geometry><sphere radius='0.1'/></geometry></collision></link>
  <joint name='hinge' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 1 0'/>
    <origin xyz='0 0 2' rpy='0 0 0'/></joint>
  <joint name='flange' type='fixed'><parent link='arm'/><child link='tool'/>
    <origin xyz='0 0 -1' rpy='0 3.141592653589793 0'/></joint>
  GAZEBO</robot>)";

TEST_F(GazeboFiles, AUrdfHasTheSensorsOfItsLinksAndJoints) {
  const std::string robot = replaced(kRobot, "GAZEBO", R"(
  <gazebo reference='flange'><sensor name='ft' type='force_torque'><update_rate>100</update_rate>
    <force_torque><frame>sensor</frame><measure_direction>parent_to_child</measure_direction>
    <force><x><noise type='gaussian'><mean>0.5</mean><stddev>0.25</stddev></noise></x></force>
    </force_torque></sensor></gazebo>
  <gazebo reference='hinge'><sensor name='ft' type='force_torque'/></gazebo>
  <gazebo reference='hinge'><sensor name='fp' type='force_torque'><force_torque><frame>parent</frame>
    </force_torque></sensor></gazebo>
  <gazebo reference='tool'><material>Gazebo/Red</material><mu1>0.3</mu1>
    <sensor name='imu' type='imu'><imu/></sensor>
    <sensor name='bump' type='contact'><contact><collision>tool_collision</collision></contact>
    </sensor>
    <sensor name='eye' type='ray'><pose>0 0 -0.2 0 1.5707963267948966 0</pose><ray>
      <scan><horizontal><samples>1</samples><min_angle>0</min_angle><max_angle>0</max_angle>
      </horizontal></scan><range><min>0</min><max>10</max></range>
      <noise><type>gaussian</type><mean>0</mean><stddev>0.125</stddev></noise></ray></sensor>
    <sensor name='cam' type='camera'><camera/></sensor>
  </gazebo>)");
  write("r.urdf", robot);
  Scene scene = load("scene.yaml", R"(gravity: [0, 0, -9.8]
models:
  - {urdf: r.urdf, name: one}
  - {urdf: r.urdf, name: two, position: [5, 0, 0]}
ground: {}
)");
  ASSERT_EQ(scene.model.sensors().size(), 12u) << notes_of(scene);
  expect_parts(notes_of(scene), {"r.urdf", "camera", "has no counterpart"});
  const Sensor& ft = scene.model.sensors()[0];
  EXPECT_EQ(ft.name, "one/flange/ft");
  EXPECT_EQ(ft.errors.rate, 100.0);
  EXPECT_EQ(ft.errors.noise, (std::vector<double>{0.25, 0, 0, 0, 0, 0}));
  EXPECT_EQ(ft.errors.bias, (std::vector<double>{0.5, 0, 0, 0, 0, 0}));
  Sensed run(std::move(scene));
  run.step();
  for (const std::string name : {"one", "two"}) {
    // The tool is upside down: what holds it pulls it along its -z.
    EXPECT_LE((run.vector(name + "/flange/ft.fx") - Vector3(0, 0, -0.5 * 9.8)).norm(), kRounding);
    for (const char* ft_name : {"/hinge/ft.fx", "/hinge/fp.fx"})
      EXPECT_LE((run.vector(name + ft_name) - Vector3(0, 0, -kWeight)).norm(), kRounding);
    EXPECT_LE((run.vector(name + "/tool/imu.ax") - Vector3(0, 0, -9.8)).norm(), kRounding);
    EXPECT_EQ(run.vector(name + "/tool/bump.fx").norm(), 0.0);
  }
}

constexpr const char* kCrate = R"(<sdf version='1.9'><world name='w'><gravity>0 0 -10</gravity>
  <model name='floor'><static>1</static><link name='l'><collision name='c'><geometry><plane/></geometry>
    </collision><sensor name='still' type='imu'/></link></model>
  <model name='m'><pose>0 0 0.5 0 0 0</pose><link name='crate'>
    <inertial><mass>3</mass></inertial>
    <collision name='box'><geometry><box><size>1 1 1</size></box></geometry></collision>
    <collision name='lid'><pose>0 0 0.6 0 0 0</pose><geometry><box><size>1 1 0.2</size></box>
      </geometry></collision>
    SENSORS</link></model></world></sdf>)";

TEST_F(GazeboFiles, AContactSensorReadsTheForceOnItsCollision) {
  Sensed run(load("crate.sdf", replaced(kCrate, "SENSORS", R"(
    <sensor name='one' type='contact'><contact><collision>box</collision></contact></sensor>
    <sensor name='two' type='contact'><contact><collision>m::crate::box</collision>
      <collision>lid</collision></contact></sensor>)")));
  for (int i = 0; i < 100; ++i) run.step();
  // At rest on the floor; the impact speed of the first contact is zero, so the crate settles to
  // 1e-3 of its weight.
  const Vector3 weight(0, 0, 30);
  EXPECT_LE((run.vector("m/crate/one.fx") - weight).norm(), 0.03);
  EXPECT_EQ(run.vector("m/crate/two/box.fx"), run.vector("m/crate/one.fx"));
  EXPECT_EQ(run.vector("m/crate/two/lid.fx"), Vector3::Zero());
  expect_parts(notes_of(run.simulator.scene()), {"crate.sdf:3: <sensor> 'still'", "static model"});
}

TEST_F(GazeboFiles, ALidarOfOneRayReadsARange) {
  const std::string lidar = R"(<sensor name='eye' type='TYPE'><pose>0 0 1 0 0 0</pose>
      <update_rate>20</update_rate><lidar><scan>
      <horizontal><samples>RAYS</samples><min_angle>0.5</min_angle><max_angle>0.5</max_angle>
      </horizontal><vertical><samples>1</samples><min_angle>-0.7853981633974483</min_angle>
      <max_angle>-0.7853981633974483</max_angle></vertical></scan>
      <range><min>0.1</min><max>8</max></range><noise><type>gaussian</type><mean>0.5</mean>
      <stddev>0.25</stddev></noise></lidar></sensor>)";
  for (const std::string type : {"ray", "gpu_ray", "lidar", "gpu_lidar"}) {
    const std::string one = replaced(replaced(lidar, "TYPE", type), "RAYS", "1");
    Sensed run(load("crate.sdf", replaced(kCrate, "SENSORS", one)));
    run.step();
    // 1.5 m above the floor, 45 degrees downward: an error of 1e-9 m is rounding of the angle and
    // the depth of the crate at rest.
    EXPECT_NEAR(run.value("m/crate/eye.range"), 1.5 * std::sqrt(2.0), 1e-9) << type;
    const Sensor& eye = run.simulator.model().sensors()[0];
    EXPECT_EQ(eye.limit, 8.0);
    EXPECT_EQ(eye.errors.rate, 20.0);
    EXPECT_EQ(eye.errors.bias, std::vector<double>{0.5});
    EXPECT_EQ(eye.errors.noise, std::vector<double>{0.25});
  }
  const Scene many =
      load("crate.sdf",
           replaced(kCrate, "SENSORS", replaced(replaced(lidar, "TYPE", "ray"), "RAYS", "90")));
  EXPECT_TRUE(many.model.sensors().empty());
  expect_parts(notes_of(many), {"'eye'", "90 rays", "one ray is expected"});
}

TEST_F(GazeboFiles, ACollisionOfAUrdfIsFoundByTheNamesThatGazeboGives) {
  const std::string sensor = R"(<gazebo reference='LINK'><sensor name='s' type='contact'><contact>
      <collision>NAME</collision></contact></sensor></gazebo>)";
  const auto robot = [&](const std::string& link, const std::string& name) {
    return replaced(kRobot, "GAZEBO", replaced(replaced(sensor, "LINK", link), "NAME", name));
  };
  for (const auto& [link, name] : std::vector<std::pair<std::string, std::string>>{
           {"tool", "0"},
           {"tool", "tool_collision"},
           {"arm", "tool_collision"},
           {"arm", "arm_fixed_joint_lump__tool_collision"},
           {"arm", "arm_fixed_joint_lump__tool_collision_2"}}) {
    const Scene scene = load("r.urdf", robot(link, name));
    ASSERT_EQ(scene.model.sensors().size(), 1u) << name << notes_of(scene);
    const auto& geometries = scene.model.sensors()[0].geometries;
    ASSERT_EQ(geometries.size(), 1u) << name;
    EXPECT_EQ(scene.model.geometries()[static_cast<std::size_t>(geometries[0])].name, "tool/0");
    EXPECT_EQ(notes_of(scene).find("no collision"), std::string::npos) << name;
  }
  expect_parts(notes_of(load("r.urdf", robot("tool", "spoon"))),
               {"r.urdf:", "there is no collision 'spoon'; all of link 'tool' count"});
}

constexpr const char* kMotors = R"(
  <plugin filename='gz-sim-joint-position-controller-system'
    name='gz::sim::systems::JointPositionController'><joint_name>hinge</joint_name>
    <p_gain>20</p_gain><i_gain>3</i_gain><d_gain>0.5</d_gain><i_max>2</i_max><i_min>-2</i_min>
    <cmd_max>40</cmd_max><cmd_min>-30</cmd_min><initial_position>0.25</initial_position></plugin>
  <plugin filename='libignition-gazebo-joint-controller-system.so'
    name='ignition::gazebo::systems::JointController'><joint_name>hinge</joint_name>
    <use_force_commands>true</use_force_commands><p_gain>0.5</p_gain></plugin>
  <plugin filename='gz-sim-apply-joint-force-system' name='gz::sim::systems::ApplyJointForce'>
    <joint_name>hinge</joint_name></plugin>
  <plugin filename='libgazebo_ros_control.so' name='ros_control'/>)";

void expect_motors(const Scene& scene) {
  ASSERT_EQ(scene.model.actuators().size(), 3u) << notes_of(scene);
  const Actuator &pid = scene.model.actuators()[0], &speed = scene.model.actuators()[1],
                 &force = scene.model.actuators()[2];
  EXPECT_EQ(pid.name, "hinge/position");
  EXPECT_EQ(pid.law, ActuatorLaw::kPid);
  EXPECT_EQ((std::vector<double>{pid.kp, pid.ki, pid.kd, pid.integral_limit, pid.least, pid.most,
                                 pid.command}),
            (std::vector<double>{20, 3, 0.5, 2, -30, 40, 0.25}));
  EXPECT_EQ(speed.name, "hinge/velocity");
  EXPECT_EQ(
      (std::vector<double>{speed.gain, speed.damping, speed.stiffness, speed.bias, speed.most}),
      (std::vector<double>{0.5, 0.5, 0, 0, 1000}));
  EXPECT_EQ(force.name, "hinge/force");
  EXPECT_EQ((std::vector<double>{force.gain, force.damping, force.bias}),
            (std::vector<double>{1, 0, 0}));
  expect_parts(notes_of(scene), {"<plugin> 'ros_control'", "libgazebo_ros_control.so"});
}

std::string with_motors(const std::string& motors) {
  return replaced(R"(<sdf version='1.9'><model name='m'><link name='base'/><link name='arm'/>
  <joint name='fix' type='fixed'><parent>world</parent><child>base</child></joint>
  <joint name='hinge' type='revolute'><parent>base</parent><child>arm</child>
    <axis><xyz>0 1 0</xyz></axis></joint>MOTORS</model></sdf>)",
                  "MOTORS", motors);
}

TEST_F(GazeboFiles, ControllersOfAJointAreActuators) {
  expect_motors(load("arm.sdf", with_motors(kMotors)));
  expect_motors(load("arm.urdf",
                     replaced(kRobot, "GAZEBO", "<gazebo>" + std::string(kMotors) + "</gazebo>")));
}

TEST_F(GazeboFiles, ControllersWithoutACounterpartAreNoted) {
  const auto noted = [&](const std::string& system, const std::string& inside) {
    const Scene scene =
        load("arm.sdf", with_motors("<plugin filename='f' name='gz::sim::systems::" + system +
                                    "'>" + inside + "</plugin>"));
    EXPECT_TRUE(scene.model.actuators().empty());
    return notes_of(scene);
  };
  const std::string hinge = "<joint_name>hinge</joint_name>", position = "JointPositionController";
  expect_parts(noted("JointController", hinge),
               {"arm.sdf:", "JointController", "use_force_commands"});
  expect_parts(noted(position, hinge + "<use_velocity_commands>1</use_velocity_commands>"),
               {"sets the speed itself"});
  expect_parts(noted(position, hinge + "<i_max>3</i_max>"), {"<i_min> = -<i_max> is expected"});
  expect_parts(noted(position, hinge + "<cmd_offset>3</cmd_offset>"), {"<cmd_offset>"});
  expect_parts(noted(position, ""), {"one <joint_name>"});
  expect_parts(noted(position, "<joint_name>elbow</joint_name>"), {"no joint 'elbow' moves"});
  expect_parts(noted("MulticopterMotorModel", "<jointName>hinge</jointName>"),
               {"plugins do not run"});
}

TEST_F(GazeboFiles, TransmissionsAreNotedWithTheirGears) {
  const std::string notes = notes_of(load("r.urdf", replaced(kRobot, "GAZEBO", R"(
  <transmission name='t'><joint name='hinge'/><actuator name='a'>
    <mechanicalReduction>50</mechanicalReduction></actuator></transmission>)")));
  expect_parts(notes, {"<mechanicalReduction> 50 of joint 'hinge'", "<transmission> (1)"});
}

TEST_F(GazeboFiles, MistakesAreNamedWithFileLineAndElement) {
  const std::string robot =
      replaced(kRobot, "GAZEBO", "\n  <gazebo reference='R'>\n    X</gazebo>");
  const auto mistake = [&](const std::string& reference, const std::string& element) {
    return error_of("r.urdf",
                    replaced(replaced(robot, "'R'", "'" + reference + "'"), "X", element));
  };
  // The element stands in line 15.
  expect_parts(mistake("hinge",
                       "<sensor name='s' type='force_torque'><force_torque><frame>elbow"
                       "</frame></force_torque></sensor>"),
               {"r.urdf:15: <force_torque>", "parent, child or sensor is expected"});
  expect_parts(mistake("hinge",
                       "<sensor name='s' type='force_torque'><force_torque>"
                       "<measure_direction>up</measure_direction></force_torque></sensor>"),
               {"r.urdf:15: <force_torque>", "child_to_parent or parent_to_child is expected"});
  expect_parts(
      mistake("tool", "<sensor name='s' type='imu'><update_rate>fast</update_rate></sensor>"),
      {"r.urdf:15: ", "<update_rate>"});
  expect_parts(error_of("arm.sdf", with_motors("\n<plugin filename='f' name='gz::sim::systems::"
                                               "JointPositionController'>\n<p_gain>high</p_gain>"
                                               "</plugin>")),
               {"arm.sdf:5: <plugin>", "<p_gain>: 'high': a number is expected"});
  expect_parts(notes_of(load("r.urdf", replaced(replaced(robot, "'R'", "'elbow'"), "X",
                                                "<sensor name='s' type='imu'/>"))),
               {"r.urdf:15: <sensor>", "reference 'elbow' is no link and no joint"});
}

TEST_F(GazeboFiles, AWrenchIsRelativeToTheLinkAbove) {
  write("r.urdf", replaced(kRobot, "GAZEBO", ""));
  const auto scene = [](const std::string& sensors) {
    return "models:\n  - {urdf: r.urdf}\nsensors:\n" + sensors;
  };
  Sensed run(
      load("scene.yaml", scene("  - {name: a, kind: wrench, link: tool}\n"
                               "  - {name: b, kind: wrench, link: tool, relative_to: arm}\n")));
  run.step();
  EXPECT_EQ(run.vector("a.fx"), -run.vector("b.fx"));
  EXPECT_EQ(run.vector("a.tx"), -run.vector("b.tx"));
  expect_parts(
      error_of("scene.yaml", scene("  - {name: b, kind: wrench, link: tool, relative_to: base}\n")),
      {"scene.yaml:4", "'base' is not the link that the sensor's link hangs on"});
}

}  // namespace
}  // namespace counterpoint::gazebo_files_test
