// Sensors through files: `simulate --sensors` and `inverse --sensors` write the same table, and
// `inspect` lists its columns.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "apps/command.h"

namespace counterpoint::sensors_command_test {
namespace {

const std::string kScene = "data/scenes/sensors.yaml";

TEST(SensorsCommand, ARecordedMotionHasTheReadingsOfItsSimulation) {
  const test::CommandFolder folder("sensors_same");
  folder.succeed("simulate " + kScene +
                 " --duration 0.3 --random-inputs 0.5 --output {}/m.csv --sensors {}/s.csv");
  folder.succeed("inverse " + kScene + " {}/m.csv --sensors {}/again.csv");
  EXPECT_EQ(folder.lines("s.csv"), 301);  // a line of names, and one for each step
  EXPECT_EQ(folder.read("s.csv"), folder.read("again.csv"));
  folder.succeed("simulate " + kScene + " --duration 0.01 --seed 1 --sensors {}/other.npz");
  EXPECT_GT(folder.read("other.npz").size(), 1000u);
}

TEST(SensorsCommand, InspectListsTheColumnsOfTheTable) {
  const test::CommandFolder folder("sensors_inspect");
  const nlohmann::json report = folder.report("inspect " + kScene);
  std::string names = "time";
  for (const auto& sensor : report["sensors"])
    for (const auto& column : sensor["columns"]) names += "," + column["name"].get<std::string>();
  folder.succeed("simulate " + kScene + " --duration 0.002 --sensors {}/s.csv");
  const std::string text = folder.read("s.csv");
  EXPECT_EQ(text.substr(0, text.find('\n')), names);
  const nlohmann::json& imu = report["sensors"][0];
  EXPECT_EQ(imu["kinds"], (nlohmann::json{"specific_force", "angular_velocity"}));
  EXPECT_EQ(imu["columns"][0]["unit"], "m/s^2");
  EXPECT_EQ(imu["columns"][0]["frame"], "sensor");
}

/// Lines of two tables side by side, as many as the second has.
std::string side_by_side(const std::string& a, const std::string& b) {
  std::istringstream left(a), right(b);
  std::string joined, one, other;
  while (std::getline(right, other) && std::getline(left, one)) joined += one + "," + other + "\n";
  return joined;
}

/// A simulation compared with its own motion and readings differs by nothing; all sensors of the
/// scene are named without more.
TEST(SensorsCommand, CompareTakesTheSensorsOfTheSceneByName) {
  const test::CommandFolder folder("sensors_compare");
  folder.succeed("simulate " + kScene + " --duration 0.2 --output {}/m.csv --sensors {}/s.csv");
  std::string readings = folder.read("s.csv");
  readings.replace(0, 4, "again");  // the column of the time is that of the motion
  const std::string motion = folder.read("m.csv");
  folder.write("both.csv", side_by_side(motion, readings));
  std::string map = "time: time\ncolumns:\n", sensors = "sensors:\n";
  const nlohmann::json scene = folder.report("inspect " + kScene);
  for (const char* kind : {"q", "v"})
    for (const auto& name : scene["coordinates"][kind])
      map += fmt::format("  {0}: {0}\n", name.get<std::string>());
  std::size_t columns = 0;
  for (const auto& sensor : scene["sensors"]) {
    sensors += fmt::format("  {}: {{}}\n", sensor["name"].get<std::string>());
    columns += sensor["columns"].size();
  }
  folder.write("map.yaml", map + sensors);
  const nlohmann::json report = folder.report("compare " + kScene + " {}/both.csv --columns " +
                                              "{}/map.yaml --output {}/rows.csv");
  EXPECT_LE(report["sensors"].size(), columns);
  EXPECT_GT(report["sensors"].size(), columns / 2);  // a ray that meets nothing has no reading
  for (const auto& one : report["sensors"]) {
    const std::string name = one["name"];
    // The readings of these two have errors: noise, delay, rounding to 0.001 rad.
    const bool exact = !name.starts_with("imu.") && !name.starts_with("encoder.");
    EXPECT_EQ(one["rms"].get<double>() <= 1e-6, exact) << name;  // rounding over the step of 1 ms
  }
  EXPECT_NE(folder.read("rows.csv").find(".ax.recorded"), std::string::npos);
  folder.refuse("compare " + kScene + " {}/both.csv --columns {}/map.yaml --mode inverse",
                "only `explain`");
}

TEST(SensorsCommand, WhatCannotBeReadIsRefused) {
  const test::CommandFolder folder("sensors_refused");
  folder.refuse("simulate data/scenes/pendulum.yaml --sensors {}/s.csv",
                "the scene has no sensors");
  folder.refuse("simulate " + kScene + " --integrator runge_kutta_4 --sensors {}/s.csv",
                "runge_kutta_4 has no inverse");
}

}  // namespace
}  // namespace counterpoint::sensors_command_test
