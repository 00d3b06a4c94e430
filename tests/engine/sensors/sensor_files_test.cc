// Sensors of scene files and of MuJoCo's files: the same quantities under the same names.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/sensors/sensed.h"
#include "support/temp_folder.h"

namespace counterpoint::sensor_files_test {
namespace {

using test::Sensed;

constexpr const char* kRobot = R"(<mujoco>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="post" pos="0 0 2">
      <joint name="hinge" axis="0 1 0" damping="0.1"/>
      <geom name="rod" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/>
      <site name="eye" pos="0.1 0 -0.4" euler="180 0 0"/>
      <site name="meter" pos="0 0.02 -0.3" euler="10 20 30"/>
      <body name="tool" pos="0 0 -0.5" euler="0 30 0">
        <geom name="bob" type="sphere" size="0.08"/>
        <site name="flange" pos="0.01 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="hinge"/></actuator>
  <sensor>SENSORS</sensor>
</mujoco>)";

constexpr const char* kMjcfSensors = R"(
    <accelerometer name="acc" site="meter"/><gyro name="gyro" site="meter"/>
    <velocimeter name="velo" site="meter"/>
    <force name="f" site="flange"/><torque name="t" site="flange"/>
    <jointpos name="q" joint="hinge"/><jointvel name="v" joint="hinge"/>
    <actuatorfrc name="u" actuator="drive"/>
    <framepos name="p" objtype="xbody" objname="tool" reftype="xbody" refname="post"/>
    <framequat name="x" objtype="site" objname="meter"/>
    <framelinvel name="lv" objtype="xbody" objname="tool"/>
    <frameangvel name="av" objtype="xbody" objname="tool"/>
    <framelinacc name="la" objtype="xbody" objname="tool"/>
    <frameangacc name="aa" objtype="xbody" objname="tool"/>
    <subtreecom name="com" body="post"/><subtreelinvel name="comv" body="post"/>
    <subtreeangmom name="ang" body="post"/>
    <rangefinder name="eye" site="eye"/>)";

constexpr const char* kYamlSensors = R"(
sensors:
  - {name: acc, kind: accelerometer, link: post, position: [0, 0.02, -0.3], quaternion: QUAT}
  - {name: gyro, kind: gyro, link: post, position: [0, 0.02, -0.3], quaternion: QUAT}
  - {name: velo, kind: linear_velocity, in: link, link: post, position: [0, 0.02, -0.3],
     quaternion: QUAT}
  - {name: f, kind: force, link: tool, position: [0.01, 0, 0]}
  - {name: t, kind: torque, link: tool, position: [0.01, 0, 0]}
  - {name: q, kind: joint_position, joint: hinge}
  - {name: v, kind: joint_velocity, joint: hinge}
  - {name: u, kind: joint_effort, joint: hinge}
  - {name: p, kind: position, link: tool, relative_to: post}
  - {name: x, kind: orientation, link: post, quaternion: QUAT}
  - {name: lv, kind: linear_velocity, link: tool}
  - {name: av, kind: angular_velocity, link: tool}
  - {name: la, kind: specific_force, link: tool}
  - {name: aa, kind: angular_acceleration, link: tool}
  - {name: com, kind: center_of_mass, link: post}
  - {name: comv, kind: center_of_mass_velocity, link: post}
  - {name: ang, kind: angular_momentum, link: post}
  - {name: eye, kind: range, link: post, position: [0.1, 0, -0.4], axis: [0, 0, -1]}
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

Scene load_mjcf_with(const test::TempFolder& folder, const std::string& sensors) {
  return load_scene(folder.write("robot.xml", replaced(kRobot, "SENSORS", sensors)));
}

Scene load_yaml_with(const test::TempFolder& folder, const std::string& sensors) {
  folder.write("plain.xml", replaced(kRobot, "SENSORS", ""));
  return load_scene(folder.write(
      "scene.yaml", "models:\n  - {mjcf: plain.xml}\ngravity: [0, 0, -9.81]\n" + sensors));
}

/// Expects an InputError with these parts.
template <class Action>
void expect_error(const Action& action, const std::vector<std::string>& parts) {
  try {
    action();
    ADD_FAILURE() << "accepted; expected " << parts.front();
  } catch (const InputError& error) {
    for (const std::string& part : parts)
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(SensorsOfFiles, MjcfSensorsReadWhatTheSameSensorsOfASceneFileRead) {
  const test::TempFolder folder;
  // The site's euler angles about its own x, y, z axes, in degrees.
  const double degree = M_PI / 180.0;
  const Quaternion x(Eigen::AngleAxisd(10 * degree, Vector3::UnitX()) *
                     Eigen::AngleAxisd(20 * degree, Vector3::UnitY()) *
                     Eigen::AngleAxisd(30 * degree, Vector3::UnitZ()));
  char quaternion[200];
  std::snprintf(quaternion, sizeof quaternion, "[%.17g, %.17g, %.17g, %.17g]", x.w(), x.x(), x.y(),
                x.z());
  Scene by_mjcf = load_mjcf_with(folder, kMjcfSensors);
  Scene by_yaml = load_yaml_with(folder, replaced(kYamlSensors, "QUAT", quaternion));
  for (Scene* scene : {&by_mjcf, &by_yaml}) {
    scene->q[0] = 0.7;
    scene->v[0] = -1.5;
    scene->options.time_step = 0.002;
  }
  Sensed a(std::move(by_mjcf)), b(std::move(by_yaml));
  ASSERT_EQ(a.table.size(), b.table.size());
  for (int i = 0; i < a.table.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_EQ(a.table.columns()[k].name, b.table.columns()[k].name);
    EXPECT_EQ(a.table.columns()[k].frame, b.table.columns()[k].frame);
  }
  for (int i = 0; i < 100; ++i) {
    a.simulator.input().applied_force[0] = b.simulator.input().applied_force[0] = 0.3;
    a.step();
    b.step();
    for (int k = 0; k < a.table.size(); ++k)
      // Rotations come from angles on one side: rounding of sines, times values of up to 50.
      EXPECT_NEAR(a.values[k], b.values[k], 1e-12)
          << a.table.columns()[static_cast<std::size_t>(k)].name << " step " << i;
  }
  EXPECT_NEAR(a.value("u.u"), 0.3, 1e-9);
  EXPECT_GT(a.value("eye.range"), 1.0);
}

TEST(SensorsOfFiles, AHangingMassPullsItsFlangeDownSoTheSensorReadsItsWeightUpwards) {
  const test::TempFolder folder;
  Sensed run(load_mjcf_with(folder, R"(<force name="f" site="flange"/>)"));
  run.step();
  const double mass =
      run.simulator.model()
          .frames()[static_cast<std::size_t>(run.simulator.model().find_frame("tool"))]
          .inertia.mass;
  const double lean = 30.0 * M_PI / 180.0;
  const Vector3 expected(-std::sin(lean), 0.0, std::cos(lean));
  // At rest but for the small torque of the tool's offset: 1e-3 of the weight.
  EXPECT_LE((run.vector("f.fx") / (9.81 * mass) - expected).norm(), 1e-3);
}

TEST(SensorsOfFiles, MjcfSensorsWithoutCounterpartAreNoted) {
  const test::TempFolder folder;
  const Scene scene = load_mjcf_with(folder, R"(<magnetometer name="m" site="meter"/>
      <accelerometer name="a" site="nowhere"/><jointpos name="q" joint="hinge" noise="0.1"/>)");
  ASSERT_EQ(scene.model.sensors().size(), 1u);
  EXPECT_EQ(scene.model.sensors()[0].name, "q");
  int found = 0;
  for (const Note& note : scene.model.notes()) {
    found += note.message.find("<magnetometer> has no counterpart") != std::string::npos;
    found += note.message.find("there is no site 'nowhere'") != std::string::npos;
    found += note.message.find("noise is not used") != std::string::npos;
  }
  EXPECT_EQ(found, 3);
}

TEST(SensorsOfFiles, AnImuOfAnSdfFileIsRead) {
  const test::TempFolder folder;
  const auto file = folder.write("robot.sdf", R"(<?xml version='1.0'?>
    <sdf version='1.9'><model name='m'><link name='body'>
      <inertial><mass>2</mass></inertial>
      <sensor name='imu' type='imu'><pose>0.1 0 0 0 0 1.5</pose><update_rate>50</update_rate>
        <imu><linear_acceleration><y><noise type='gaussian'><mean>0.2</mean><stddev>0.3</stddev>
        </noise></y></linear_acceleration></imu></sensor>
      <sensor name='high' type='altimeter'/>
    </link></model></sdf>)");
  Scene scene;
  try {
    scene = load_scene(file);
  } catch (const InputError& error) {
    if (std::string(error.what()).find("built without SDF") == std::string::npos) throw;
    GTEST_SKIP() << error.what();
  }
  ASSERT_EQ(scene.model.sensors().size(), 1u);
  const Sensor& imu = scene.model.sensors()[0];
  EXPECT_EQ(imu.name, "body/imu");
  EXPECT_EQ(imu.errors.rate, 50.0);
  EXPECT_EQ(imu.errors.noise, (std::vector<double>{0, 0.3, 0, 0, 0, 0}));
  EXPECT_EQ(imu.errors.bias, (std::vector<double>{0, 0.2, 0, 0, 0, 0}));
  EXPECT_LE((imu.X_FS.translation - Vector3(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_NEAR(imu.X_FS.rotation(1, 0), std::sin(1.5), 1e-15);
  int noted = 0;
  for (const Note& note : scene.model.notes())
    noted += note.message.find("altimeter") != std::string::npos;
  EXPECT_EQ(noted, 1);
}

TEST(SensorsOfFiles, MistakesAreNamedWithTheirLine) {
  const test::TempFolder folder;
  const auto load = [&](const std::string& sensor) {
    return [&folder, sensor] { load_yaml_with(folder, "sensors:\n  - {" + sensor + "}\n"); };
  };
  expect_error(load("name: a, kind: imu, link: tol"), {"scene.yaml:5", "no link 'tol'", "'tool'"});
  expect_error(load("name: a, kind: camera, link: tool"), {"scene.yaml:5", "camera", "imu"});
  expect_error(load("name: a, kind: imu"), {"scene.yaml:5", "sensor 'a'", "needs a link"});
  expect_error(load("name: a, kind: joint_velocity, joint: hing"), {"no joint 'hing'", "hinge"});
  expect_error(load("name: a, kind: joint_velocity, link: tool"), {"joint in place of link"});
  expect_error(load("name: a, kind: wrench"), {"scene.yaml:5", "needs a link"});
  expect_error(load("name: a, kind: imu, link: tool, noise: [1, 2, 3]"), {"noise has 3 numbers"});
  expect_error(load("name: a, kind: wrench, link: tool, in: link"),
               {"axes of this kind are fixed"});
  expect_error(load("name: a, kind: imu, link: tool, limit: 3"), {"for a range only"});
  expect_error(load("name: a, kind: accelerometer, link: tool, relative_to: post"),
               {"relative_to is for positions"});
  expect_error(load("name: a, kind: position, link: tool, from: world/floor"),
               {"`from` is for a contact"});
  expect_error(load("name: a, kind: imu, link: tool}\n  - {name: a, kind: imu, link: tool"),
               {"scene.yaml:6", "already a sensor"});
}

TEST(SensorsOfFiles, AnArchiveKeepsSensorsWithTheirErrors) {
  const test::TempFolder folder;
  const Scene scene = load_yaml_with(
      folder,
      "sensors:\n  - {name: a, kind: imu, link: tool, noise: [0.1, 0.2], bias: 3, quantum: 0.01, "
      "rate: 100, delay: 0.02}\n  - {name: c, kind: contact_force, link: tool, from: "
      "world/floor}\n");
  const Scene copy = restore_scene(archive_scene(scene));
  ASSERT_EQ(copy.model.sensors().size(), 2u);
  EXPECT_EQ(copy.model.sensors()[0].errors, scene.model.sensors()[0].errors);
  EXPECT_EQ(copy.model.sensors()[0].errors.noise,
            (std::vector<double>{0.1, 0.1, 0.1, 0.2, 0.2, 0.2}));
  EXPECT_EQ(copy.model.sensors()[1].geometries, scene.model.sensors()[1].geometries);
  EXPECT_EQ(copy.model.sensors()[1].others, scene.model.sensors()[1].others);
}

}  // namespace
}  // namespace counterpoint::sensor_files_test
