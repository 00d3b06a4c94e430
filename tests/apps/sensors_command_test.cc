// Sensors through files: `simulate --sensors` and `inverse --sensors` write the same table, and
// `inspect` lists its columns.
#include <gtest/gtest.h>

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

TEST(SensorsCommand, WhatCannotBeReadIsRefused) {
  const test::CommandFolder folder("sensors_refused");
  folder.refuse("simulate data/scenes/pendulum.yaml --sensors {}/s.csv",
                "the scene has no sensors");
  folder.refuse("simulate " + kScene + " --integrator runge_kutta_4 --sensors {}/s.csv",
                "runge_kutta_4 has no inverse");
}

}  // namespace
}  // namespace counterpoint::sensors_command_test
