// compare: the score of a rollout against a recording.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/command.h"

namespace counterpoint {
namespace {

using test::CommandFolder;
using test::CommandResult;

constexpr double kGravity = 9.81;  // [m/s^2], the scene's
constexpr double kRate = 148.0;    // [1/s]

/// A recording of a ballistic flight without rotation; velocities are backward differences.
std::string ballistic_recording(int rows) {
  std::string csv = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
  for (int k = 0; k < rows; ++k) {
    const double t = k / kRate;
    const double z = 5.0 + 1.0 * t - 0.5 * kGravity * t * t;
    const double vz = 1.0 - kGravity * (t - 0.5 / kRate);
    csv += fmt::format("{},{:.17g},0,{:.17g},1,0,0,0,0.5,0,{:.17g},0,0,0\n", t, 0.5 * t, z, vz);
  }
  return csv;
}

TEST(Compare, StartsAFlightWithTheVelocityAtTheRow) {
  const CommandFolder folder("compare_flight");
  folder.write("flight.csv", ballistic_recording(60));
  const CommandResult result = folder.run(
      "compare data/scenes/cube_toss.yaml {}/flight.csv --columns data/maps/cube_toss.yaml "
      "--substeps 8 --output {}/rows.csv --json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  ASSERT_EQ(report["recordings"].size(), 1u);
  for (const auto* entry : {&report["recordings"][0], &report["median"]}) {
    EXPECT_TRUE(entry->contains("position_error_mean_m"));
    EXPECT_TRUE(entry->contains("rotation_error_mean_deg"));
    // Semi-implicit Euler falls g h t / 2 too far: the discrete answer, to round-off.
    const double t = 59 / kRate;
    EXPECT_NEAR((*entry)["position_error_end_m"], 0.5 * kGravity * t / (8 * kRate), 1e-12);
    EXPECT_NEAR((*entry)["rotation_error_end_deg"], 0.0, 1e-12);
  }
  const std::string rows = folder.read("rows.csv");
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 61);
}

TEST(Compare, SaysWhatIsWrongInAColumnMap) {
  const CommandFolder folder("compare_map");
  folder.write("flight.csv", ballistic_recording(3));
  const auto expect = [&](const std::string& map, const std::string& part) {
    folder.write("map.yaml", map);
    const CommandResult result =
        folder.run("compare data/scenes/cube_toss.yaml {}/flight.csv --columns {}/map.yaml");
    EXPECT_EQ(result.exit_code, 2) << map;
    EXPECT_NE(result.errors.find(part), std::string::npos) << result.errors;
  };
  expect("rate: 148\n", "expected 'columns'");
  expect("rate: 148\ntime: t\ncolumns: {cube.x: x}\n", "either 'rate'");
  expect("rate: -1\ncolumns: {cube.x: x}\n", "map.yaml:1: rate");
  expect("rate: 148\nspeed: 3\ncolumns: {cube.x: x}\n", "map.yaml:2: unknown key 'speed'");
  expect("rate: 148\ncolumns:\n  sphere.x: x\n", "map.yaml:3: 'sphere.x' is no coordinate");
  expect("rate: 148\ncolumns:\n  cube.x: height\n", "no column 'height'");
  expect("rate: 148\nfree: cube\ncolumns: {cube.x: x}\n", "says nothing about cube.y");
  expect("rate: 148\nfree: ball\ncolumns: {cube.x: x}\n", "'ball' is no floating link");
  expect("rate: [1\n", "map.yaml:2");
}

/// A trajectory of the toss scene by the engine itself, and the column map that reads it.
void record_own_toss(const CommandFolder& folder) {
  ASSERT_EQ(folder.run("simulate data/scenes/cube_toss.yaml --output {}/own.csv").exit_code, 0);
  std::string map = "time: time\nfree: cube\nsubsteps: 1\ncolumns:\n";
  for (const char* name :
       {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"})
    map += fmt::format("  cube.{0}: cube.{0}\n", name);
  folder.write("map.yaml", map);
}

TEST(Compare, OneStepOfAnOwnTrajectoryIsExact) {
  const CommandFolder folder("compare_own");
  record_own_toss(folder);
  const auto run = [&](const std::string& arguments) {
    const CommandResult result = folder.run(
        "compare data/scenes/cube_toss.yaml {}/own.csv --columns {}/map.yaml --json "
        "{}/r.json " +
        arguments);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return folder.json("r.json")["median"];
  };
  // Differences of times are not quite the time step, nor are recorded quaternions of unit length
  // to the last bit: 1e-16 of each, and 1e-8 rad are the root of 1e-16 in an angle from a cosine.
  const nlohmann::json one_step = run("--mode one-step");
  EXPECT_LT(one_step["position_error_mean_m"], 1e-13);
  EXPECT_LT(one_step["rotation_error_mean_deg"], 1e-9);
  // It is not the recording compared with itself: another friction is seen.
  const nlohmann::json other = run("--mode one-step --set friction=0.3");
  EXPECT_GT(other["position_error_mean_m"], 1e-7);
  // Of a whole rollout the first row is the only start.
  const nlohmann::json rollout = run("");
  EXPECT_LT(rollout["position_error_mean_m"], 1e-9);
  EXPECT_GT(run("--set friction=0.3")["position_error_mean_m"],
            10 * other["position_error_mean_m"].get<double>());
}

TEST(Compare, NothingIsUnexplainedInAnOwnTrajectory) {
  const CommandFolder folder("compare_inverse");
  record_own_toss(folder);
  const auto run = [&](const std::string& arguments) {
    const CommandResult result = folder.run(
        "compare data/scenes/cube_toss.yaml {}/own.csv --columns {}/map.yaml --mode "
        "inverse --report {}/page --output {}/f.csv --json {}/r.json " +
        arguments);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return folder.json("r.json")["median"];
  };
  const nlohmann::json own = run("");
  // Contacts give by 1e-8 of their force; impacts are up to a hundred times the weight.
  EXPECT_LT(own["unexplained_force_max"], 1e-5);
  EXPECT_LT(own["unexplained_torque_max"], 1e-5);
  EXPECT_GT(own["contact_force_max"], 5.0);  // there were impacts to be explained
  EXPECT_NE(folder.read("page/index.html").find("<svg"), std::string::npos);
  // Without friction the ground cannot have slowed it down; without reach it gives nothing.
  EXPECT_GT(run("--set friction=0")["unexplained_force_mean"], 0.05);
  EXPECT_GT(run("--set height=-1")["unexplained_force_mean"], 0.5);
}

/// The bounds on the median over the recorded tosses.
constexpr double kTossPosition = 0.014;  // [m]
constexpr double kTossRotation = 14.0;   // [degrees]

TEST(Compare, PredictsRealCubeTosses) {
  const std::filesystem::path data = std::filesystem::path(COUNTERPOINT_SHARED_DATA) / "cube_toss";
  if (!std::filesystem::exists(data)) {
    GTEST_SKIP() << "no " << data << "; set COUNTERPOINT_SHARED_DATA";
  }
  const CommandFolder folder("compare_tosses");
  const CommandResult result =
      folder.run("compare data/scenes/cube_toss.yaml " + data.string() +
                 "/toss_*.csv --columns data/maps/cube_toss.yaml --json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report["recordings"].size(), 52u);
  EXPECT_LT(report["median"]["position_error_mean_m"], kTossPosition);
  EXPECT_LT(report["median"]["rotation_error_mean_deg"], kTossRotation);
}

}  // namespace
}  // namespace counterpoint
