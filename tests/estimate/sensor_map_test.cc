// Column maps with sensors, markers, other files and treadmills, and the recordings read through
// them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "counterpoint/engine/estimate/recording.h"
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
          " source: imu, deviation: [0.01, 0.1], offset: unknown}\n"
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
  expect("sensors: {a: {kind: coordinate, coordinate: elbow.q, columns: [x]}}", "expected JOINT.q");
  expect("sources: {a: {delay: unknown}}\nsensors: {}", "either 'rate'");
  expect("markers: {table: x.csv, axes: [x, x, y]}", "axes");
  expect("treadmill: 3\ncolumns: {}", "a map from trajectory columns");
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
