// Column maps with sensors, markers, other files and treadmills, and the recordings read through
// them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/model/model_builder.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::sensor_map_test {
namespace {

std::string written(const std::string& name, const std::string& text) {
  const std::string file = ::testing::TempDir() + "sensors_" + name;
  std::ofstream(file) << text;
  return file;
}

ColumnMap read_map(const std::string& text, const Model& model) {
  return load_column_map(written("map.yaml", text), model);
}

/// A box that falls on the ground, with sensors of several kinds.
Scene sensing_box() {
  using Kind = counterpoint::SensorKind;
  ModelBuilder builder(Vector3(0, 0, -9.81));
  Pose start;
  start.translation.z() = 0.12;
  builder.add_robot(object_of("box", {ShapeType::kBox, Vector3::Constant(0.1), nullptr}, 1.0),
                    Base::kFloating, start);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  const auto add = [&](const std::string& name, std::vector<Kind> kinds, bool own_axes) {
    SensorSpec spec;
    spec.sensor.name = name;
    spec.sensor.kinds = std::move(kinds);
    spec.sensor.own_axes = own_axes;
    spec.link = "body";
    if (own_axes) {
      spec.sensor.X_FS = {rotation_from_rpy(0.3, 0, 1), Vector3(0.1, 0, 0.2)};
      spec.sensor.errors.noise = {0.05, 0.002};
    }
    builder.add_sensor(spec);
  };
  add("unit", {Kind::kSpecificForce, Kind::kAngularVelocity}, true);
  add("floor", {Kind::kContactForce}, false);
  add("turn", {Kind::kAngularVelocity}, false);
  add("where", {Kind::kPosition, Kind::kOrientation}, false);
  return scene_of(builder.build());
}

TEST(SensorMap, ReadsSensorsMarkersAndSources) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  written("markers.csv", "marker,link,x,y,z\nA," + link + ",0.1,0,0\nB," + link + ",0,0.2,0\n");
  const ColumnMap map = read_map(
      "rate: 100\n"
      "sources: {imu: {time: t, delay: unknown}, plate: {rate: 1000, delay: 0.01}}\n"
      "sensors:\n"
      "  unit: {kind: imu, link: " +
          link +
          ", rotation: [0, 0, 1.57], columns: [a, b, c, d, e, f],"
          " source: imu, deviation: [0.01, 0.1], offset: unknown, scale: none,"
          " placement: unknown}\n"
          "  floor: {kind: contact_force, links: [" +
          link +
          "], columns: [fx, fy, fz], source: plate}\n"
          "markers: {table: sensors_markers.csv, axes: [x, -z, y], scale: 0.001, deviation: "
          "0.002}\n",
      scene.model);
  ASSERT_EQ(map.sensors.size(), 5u);
  EXPECT_EQ(map.sensors[0].kind, SensorKind::kAngularVelocity);
  EXPECT_EQ(map.sensors[1].kind, SensorKind::kSpecificForce);
  EXPECT_EQ(map.sensors[1].deviation, 0.1);
  EXPECT_TRUE(map.sensors[0].has_offset);
  EXPECT_FALSE(map.sensors[0].has_scale);
  EXPECT_TRUE(map.sensors[1].has_placement);
  EXPECT_EQ(map.sensors[1].columns[2].column, "f");
  EXPECT_EQ(map.sensors[4].columns[1].column, "B.z");
  EXPECT_EQ(map.sensors[4].columns[1].scale, -0.001);
  EXPECT_EQ(map.sources[1].delay, 0.01);
  EXPECT_GT(map.sources[0].delay_deviation, 0.0);
  EXPECT_THROW(refuse_sensors(map, "compare"), InputError);
}

TEST(SensorMap, RefusesWhatCannotBeMeant) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      read_map("rate: 100\n" + text, scene.model);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& text, const std::string& words) {
    EXPECT_NE(refusal(text).find(words), std::string::npos) << text << "\n" << refusal(text);
    EXPECT_NE(refusal(text).find("map.yaml:"), std::string::npos) << "file and line";
  };
  expect("sensors: {a: {kind: sonar, link: " + link + ", columns: [x]}}", "expected one of point");
  expect("sensors: {a: {kind: point, columns: [x, y, z]}}", "expected 'link'");
  expect("sensors: {a: {kind: point, link: nowhere, columns: [x, y, z]}}", "no link of this scene");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y]}}", "a list of 3");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, 3]}}", "name of a column");
  expect("sensors: {a: {kind: imu, link: " + link + ", columns: [a, b, c, d, e, f], deviation: 1}}",
         "list of two");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, z], deviation: 0}}",
         "not positive");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, z], source: b}}",
         "not among 'sources'");
  expect("sensors: {a: {kind: orientation, link: " + link +
             ", columns: [w, x, y, z], offset: unknown}}",
         "an orientation has none");
  expect("sensors: {a: {kind: contact_force, links: [" + link +
             "], columns: [x, y, z], placement: unknown}}",
         "does not depend on where it is");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, z], scale: 2}}",
         "expected unknown or none");
  expect("sensors: {a: {kind: coordinate, coordinate: elbow.q, columns: [x]}}", "expected JOINT.q");
  expect("sources: {a: {delay: unknown}}\nsensors: {}", "either 'rate'");
  expect("markers: {table: x.csv, axes: [x, x, y]}", "axes");
  expect("treadmill: 3\ncolumns: {}", "a map from trajectory columns");
}

/// A sensor of the scene is the measurement that a map describes with the same place.
TEST(SensorMap, TakesSensorsOfTheSceneByName) {
  const Scene scene = sensing_box();
  const ColumnMap map = read_map(
      "rate: 100\nsensors:\n  unit: {}\n  floor: {columns: [a, b, {column: c, scale: -1}]}\n"
      "  turn: {deviation: 0.1, offset: unknown}\n"
      "  same: {kind: imu, link: body, position: [0.1, 0, 0.2], rotation: [0.3, 0, 1], columns: "
      "[wx, wy, wz, ax, ay, az]}\n",
      scene.model);
  ASSERT_EQ(map.sensors.size(), 6u);
  const Sensor &acceleration = map.sensors[0], &rate = map.sensors[1];
  EXPECT_EQ(acceleration.kind, SensorKind::kSpecificForce);
  EXPECT_EQ(acceleration.columns[2].column, "unit.az");
  EXPECT_EQ(acceleration.deviation, 0.05);
  EXPECT_EQ(rate.kind, SensorKind::kAngularVelocity);
  EXPECT_EQ(rate.scene_row, 3);
  EXPECT_EQ(rate.deviation, 0.002);
  for (const int part : {0, 1}) {
    const Sensor &a = map.sensors[static_cast<std::size_t>(part)],
                 &b = map.sensors[static_cast<std::size_t>(5 - part)];
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.body, b.body);
    EXPECT_LE((a.point - b.point).norm(), 1e-15);
    EXPECT_LE((a.axes - b.axes).norm(), 1e-15);
  }
  EXPECT_EQ(map.sensors[2].kind, SensorKind::kContactForce);
  EXPECT_EQ(map.sensors[2].bodies, std::vector<int>{1});
  EXPECT_EQ(map.sensors[2].columns[2].scale, -1.0);
  EXPECT_EQ(map.sensors[3].kind, SensorKind::kOther) << "angular velocity along the world's axes";
  EXPECT_THROW(read_map("rate: 100\nsensors: {nothing: {}}", scene.model), InputError);
  EXPECT_THROW(read_map("rate: 100\nsensors: {unit: {columns: [a]}}", scene.model), InputError);
}

/// Readings of the motion that is predicted differ from it by nothing, and a constant error is the
/// mean of the difference.
TEST(SensorFiles, PredictionsAreComparedWithReadings) {
  Scene scene = sensing_box();
  const ColumnMap map = read_map(
      "time: time\ncolumns: {body.x: body.x, body.y: body.y, body.z: body.z, body.qw: body.qw, "
      "body.qx: body.qx, body.qy: body.qy, body.qz: body.qz, body.vx: body.vx, body.vy: body.vy, "
      "body.vz: body.vz, body.wx: body.wx, body.wy: body.wy, body.wz: body.wz}\n"
      "sensors:\n  unit: {}\n  where: {}\n  floor: {columns: [floor.fx, floor.fy, {column: "
      "floor.fz, offset: 0.5}]}\n",
      scene.model);
  scene.v << 0.5, 0.0, 0.0, 1.0, -2.0, 3.0;
  SensorTable table(scene.model, scene.options);
  Simulator sim(scene);
  std::string rows = "time";
  for (const char* name :
       {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"})
    rows += std::string(",body.") + name;
  for (const SensorColumn& column : table.columns()) rows += "," + column.name;
  VectorX values(table.size());
  for (int row = 0; row < 50; ++row) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    table.evaluate(
        {before.q, before.v, sim.state().q, sim.state().v, sim.input(), sim.options().time_step},
        values);
    rows += fmt::format("\n{:.17g}", before.time);
    for (const double x : before.q) rows += fmt::format(",{:.17g}", x);
    for (const double x : before.v) rows += fmt::format(",{:.17g}", x);
    for (const double x : values) rows += fmt::format(",{:.17g}", x);
  }
  const std::vector<Recording> recordings = read_all({written("read.csv", rows)}, map, scene);
  refuse_sensors(map, "compare", true);
  ColumnMap impacts = map;
  impacts.after.push_back({});
  EXPECT_THROW(refuse_sensors(impacts, "compare", true), InputError);
  PredictionOptions options;
  options.scene_step = scene.options.time_step;
  Predictor predictor(scene, map, options);
  const std::vector<Prediction> predictions = {predictor.predict(recordings[0])};
  const auto metrics = sensor_metrics(scene.model, map, recordings, predictions);
  ASSERT_EQ(metrics.size(), 16u);
  // A step of 2 ms divides rounding of speeds, 1e-15 m/s after some impacts, up to 1e-9 m/s^2.
  constexpr double kSame = 1e-7;
  for (const CoordinateMetrics& one : metrics) {
    const double error = one.name == "floor.fz" ? -0.5 : 0.0;
    EXPECT_NEAR(one.mean, error, kSame) << one.name;
    EXPECT_NEAR(one.rms, std::abs(error), kSame) << one.name;
  }
  EXPECT_TRUE(std::isnan(predictions[0].sensors(0, 49))) << "no step begins at the last row";
}

TEST(SensorFiles, ReadMissingCellsAndOtherFilesAndTreadmills) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  std::string rows = "t," + link + ".x," + link + ".z,mx,my,mz\n", plate = "t,f\n";
  for (int row = 0; row < 20; ++row) {
    const double t = 0.01 * row;
    rows += std::to_string(t) + "," +
            (row == 5   ? ""
             : row == 7 ? "nan"
                        : std::to_string(2.0 * t)) +
            ",0.1," + (row == 3 ? "nan,nan,nan" : "1,2,3") + "\n";
  }
  for (int row = 0; row < 400; ++row) plate += std::to_string(0.0005 * row) + ",7\n";
  ColumnMap map = read_map(
      "time: t\ntreadmill: [-1, 0, 0]\n"
      "columns: {" +
          link + ".x: " + link + ".x, " + link + ".z: " + link +
          ".z}\nsources: {plate: {time: t}}\n"
          "contact_forces: {floor: {links: [" +
          link +
          "], z: f, source: plate}}\n"
          "sensors: {m: {kind: point, link: " +
          link + ", columns: [mx, my, mz]}}\n",
      scene.model);
  const std::string file = written("rows.csv", rows), plate_file = written("plate.csv", plate);
  EXPECT_THROW(read_all({file}, map, scene), InputError) << "an empty cell is asked for";
  map.missing_cells = true;
  Recording recording = read_all({file}, map, scene).front();
  EXPECT_EQ(recording.missing(0, 5), 1.0);
  EXPECT_EQ(recording.missing(0, 7), 1.0);
  EXPECT_EQ(recording.missing.sum(), 2.0);
  // The box moves at 2 m/s and the belt at -1 m/s: 3 m/s relative to the belt.
  EXPECT_NEAR(recording.q(0, 5), 3.0 * 0.05, 1e-9) << "between its neighbours";
  EXPECT_NEAR(recording.sensors[0].values(0, 10), 1.0 + 0.1, 1e-12);
  EXPECT_TRUE(std::isnan(recording.sensors[0].values(0, 3)));
  EXPECT_THROW(read_sources({}, map, recording), InputError) << "plate has no file";
  EXPECT_THROW(read_sources({{"plate", plate_file}, {"other", plate_file}}, map, recording),
               InputError);
  map.sources[0].delay_deviation = 0.05;
  EXPECT_THROW(read_sources({{"plate", plate_file}}, map, recording), InputError)
      << "no sensor is read from there that could tell the delay";
  map.sources[0].delay_deviation = 0.0;
  read_sources({{"plate", plate_file}}, map, recording);
  EXPECT_NEAR(recording.contact_force(2, 10), 7.0, 1e-12);
  const Recording part = rows_of(recording, 4, 3);
  EXPECT_EQ(part.num_rows(), 3);
  EXPECT_EQ(part.missing.sum(), 1.0);
}

}  // namespace
}  // namespace counterpoint::estimation::sensor_map_test
