// Sensors of MJCF files beside MuJoCo's own, at a state and its accelerations there.
#include <gtest/gtest.h>

#include "apps/command.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/sensors/sensor_table.h"
#include "peers/mujoco.h"
#include "peers/mujoco_file.h"

namespace counterpoint::sensors_mujoco_test {
namespace {

constexpr const char* kRobot = R"(<mujoco>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <geom name="floor" type="plane" size="50 50 0.1"/>
    <body name="post" pos="0 0 2">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="rod" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/>
      <site name="eye" pos="0.3 0 -0.4" euler="180 0 0"/>
      <site name="meter" pos="0 0.02 -0.3" euler="10 20 30"/>
      <body name="tool" pos="0 0 -0.5" euler="0 30 0">
        <geom name="bob" type="sphere" size="0.08" pos="0.1 0.05 0"/>
        <site name="flange" pos="0.01 0 0" euler="3 40 5"/>
        <body name="wrist" pos="0.1 0 0">
          <joint name="roll" axis="1 0.2 0"/>
          <geom type="box" size="0.1 0.05 0.02" pos="0.1 0 0"/>
          <site name="end" pos="0.2 0 0" euler="30 10 5"/>
        </body>
      </body>
    </body>
    <body name="free" pos="30 0 20">
      <freejoint/>
      <geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0"/>
      <site name="corner" pos="0.1 0.1 0.1" euler="30 60 20"/>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="hinge"/></actuator>
  <sensor>
    <accelerometer name="a1" site="meter"/><gyro name="g1" site="meter"/>
    <accelerometer name="a2" site="end"/><gyro name="g2" site="end"/>
    <accelerometer name="a3" site="corner"/><gyro name="g3" site="corner"/>
    <velocimeter name="v1" site="meter"/><velocimeter name="v2" site="end"/>
    <velocimeter name="v3" site="corner"/>
    <force name="f1" site="flange"/><torque name="t1" site="flange"/>
    <force name="f2" site="end"/><torque name="t2" site="end"/>
    <force name="f3" site="meter"/><torque name="t3" site="meter"/>
    <jointpos name="q" joint="hinge"/><jointvel name="v" joint="roll"/>
    <actuatorfrc name="u" actuator="drive"/>
    <framepos name="p" objtype="xbody" objname="tool" reftype="xbody" refname="free"/>
    <framelinvel name="rv" objtype="xbody" objname="tool" reftype="xbody" refname="free"/>
    <frameangvel name="rw" objtype="site" objname="end" reftype="xbody" refname="free"/>
    <framepos name="c" objtype="body" objname="tool"/>
    <framelinvel name="lv" objtype="xbody" objname="tool"/>
    <frameangvel name="w" objtype="xbody" objname="wrist"/>
    <framelinacc name="la" objtype="xbody" objname="wrist"/>
    <frameangacc name="aa" objtype="xbody" objname="wrist"/>
    <subtreecom name="com" body="post"/><subtreelinvel name="comv" body="post"/>
    <subtreeangmom name="l" body="post"/>
    <subtreecom name="com2" body="tool"/><subtreeangmom name="l2" body="tool"/>
    <rangefinder name="range" site="eye"/>
  </sensor>
</mujoco>)";

TEST(SensorsBesideMujoco, ReadTheSameAtTheSameAcceleration) {
  if (peers::mujoco_version().empty()) GTEST_SKIP() << "MuJoCo was not found when this was built";
  const test::CommandFolder folder("sensors_mujoco");
  folder.write("robot.xml", kRobot);
  Scene scene = load_scene(folder.path("robot.xml"));
  // Velocity-dependent forces at the state itself, as in MuJoCo's continuous equations.
  scene.options.mean_velocity_forces = false;
  const double h = 1e-3;
  VectorX q = scene.q, v(scene.model.nv()), q_next(scene.model.nq());
  q.head(2) << 0.4, -0.7;
  v << 1.0, -0.8, 0.3, 0.2, -0.5, 0.9, -0.4, 0.6;
  const peers::MjcfReadings theirs = peers::read_mjcf_sensors(folder.path("robot.xml"), q, v, 0.7);
  const VectorX v_next = v + h * theirs.acceleration;
  integrate_configuration(scene.model, q, v_next, h, q_next);
  SensorTable table(scene.model, scene.options);
  VectorX ours(table.size());
  table.evaluate({q, v, q_next, v_next, Input(), h}, ours);
  int compared = 0;
  for (std::size_t i = 0; i < scene.model.sensors().size(); ++i) {
    const std::string& name = scene.model.sensors()[i].name;
    const VectorX& reading = theirs.sensors.at(name);
    for (int k = 0; k < table.size(); ++k) {
      if (table.columns()[static_cast<std::size_t>(k)].sensor != static_cast<int>(i)) continue;
      // Rounding of accelerations over a step of 1 ms, of values of up to 100 (7e-14 measured).
      EXPECT_LE((ours.segment(k, reading.size()) - reading).norm(), 1e-11) << name;
      ++compared;
      break;
    }
  }
  EXPECT_EQ(compared, 32);
  EXPECT_EQ(theirs.sensors.size(), 32u);
}

}  // namespace
}  // namespace counterpoint::sensors_mujoco_test
