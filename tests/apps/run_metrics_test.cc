// Metrics that `simulate` reports about its steps (quantiles, energy, depth), and how it stops.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "apps/command.h"
#include "measure/step_statistics.h"

namespace counterpoint::run_metrics_test {
namespace {

using test::CommandFolder;
using test::test_name;

TEST(StepStatistics, QuantilesAreThoseOfTheSteps) {
  apps::Counts counts;
  EXPECT_EQ(counts.quantile(0.99), 0);
  for (int i = 1; i <= 200; ++i) counts.add(i);
  EXPECT_EQ(counts.quantile(0.5), 100);
  EXPECT_EQ(counts.quantile(0.99), 198);
  EXPECT_EQ(counts.quantile(1.0), 200);
  apps::StepStatistics statistics;
  for (int i = 0; i < 99; ++i) statistics.add(3, 5e-6);
  statistics.add(700, 2e-3);
  apps::Json out;
  statistics.fill(out);
  EXPECT_EQ(out["newton_iterations_p99"], 3);
  EXPECT_NEAR(out["step_time_median_us"], 5.0, 0.05);
  EXPECT_NEAR(out["step_time_p99_us"], 5.0, 0.05);
  EXPECT_NEAR(out["step_time_max_us"], 2000.0, 1e-9);
}

TEST(RunMetrics, EnergyThatTheInputGaveIsNoGain) {
  const CommandFolder folder(test_name());
  // A ball without contact is driven by random forces. Its energy is their work, to the first order
  // of the scheme.
  folder.write("ball.yaml",
               "gravity: [0, 0, 0]\ntime_step: 0.001\nduration: 1\n"
               "models:\n  - {name: ball, sphere: 0.1, mass: 1}\n");
  const nlohmann::json report = folder.report("simulate {}/ball.yaml --random-wrenches 1");
  const double work = report["input_work_J"], end = report["energy_end_J"];
  EXPECT_NEAR(work, end, 1e-9);
  EXPECT_LT(report["energy_gain_max_J"], 1e-9);
  EXPECT_EQ(report["energy_excess_J"], 0.0);  // h u'v+ exceeds it by h^2 u^2 / 2 m
  EXPECT_EQ(report["end_below_ground_m"], 0.0);
}

TEST(RunMetrics, PartingOverlapsIsNoGain) {
  const CommandFolder folder(test_name());
  // A box that starts 30 mm inside the ground is lifted out by displacements alone.
  folder.write("sunk.yaml",
               "ground: {}\nduration: 3\n"
               "models:\n  - {name: box, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.07]}\n");
  const nlohmann::json report = folder.report("simulate {}/sunk.yaml");
  const double start = report["energy_start_J"], end = report["energy_end_J"];
  const double lifted = report["overlap_work_J"], gain = report["energy_gain_max_J"];
  constexpr double kWeight = 9.80665, kPartingSpeed = 1e-3, kPartingTime = 0.1;  // N, m/s, s
  constexpr double kSunk = 1e-6;  // [J] the last micrometres take longer; compliance
  EXPECT_NEAR(end - start, kWeight * 0.03, kSunk);
  // Overlap is removed by displacement, except for the first 1 mm/s, which is a velocity.
  EXPECT_NEAR(lifted + gain, end - start, kSunk);
  EXPECT_LT(gain, kWeight * kPartingSpeed * kPartingTime);
  EXPECT_EQ(report["energy_max_J"], end);
  EXPECT_NEAR(report["below_ground_max_m"], 0.03, 1e-12);
  EXPECT_LT(report["end_below_ground_m"], 1e-6);
}

/// 40 links of 0.1 kg in a V that carry 100 kg. Without taut_links, steps of 2 ms gain energy.
std::string taut_chain(const std::string& effects) {
  constexpr int kLinks = 40;
  const double c = 0.1 * std::cos(0.349), s = 0.1 * std::sin(0.349);
  std::string models = "duration: 1\nmodels:\n", closures = "closures:\n";
  double x = -0.5 * kLinks * c, z = 6.0;
  for (int i = 0; i < kLinks; ++i) {
    const double down = i < kLinks / 2 ? 1.0 : -1.0;
    models += fmt::format(
        "  - {{name: l{}, capsule: [0.015, 0.035], mass: 0.1, position: [{}, 0, {}], rpy: [0, {}, "
        "0]}}\n",
        i, x + 0.5 * c, z - 0.5 * down * s, M_PI / 2 + down * 0.349);
    x += c;
    z -= down * s;
    if (i + 1 < kLinks)
      closures += fmt::format(
          "  - {{type: ball, between: [l{}/body, l{}/body], anchor_a: [0, 0, 0.05], anchor_b: [0, "
          "0, -0.05]}}\n",
          i, i + 1);
  }
  models +=
      fmt::format("  - {{name: load, box: [0.2, 0.2, 0.2], mass: 100, position: [0, 0, {}]}}\n",
                  6.0 - 0.5 * kLinks * s - 0.4);
  closures +=
      "  - {type: ball, between: [l0/body, world], anchor_a: [0, 0, -0.05]}\n"
      "  - {type: ball, between: [l39/body, world], anchor_a: [0, 0, 0.05]}\n"
      "  - {type: ball, between: [l19/body, load/body], anchor_a: [0, 0, 0.05], anchor_b: [0, 0, "
      "0.4]}\n";
  return models + closures + effects;
}

TEST(RunMetrics, EnergyFromNowhereAndOpenClosuresAreNamed) {
  const CommandFolder folder(test_name());
  folder.write("on.yaml", taut_chain(""));
  folder.write("off.yaml", taut_chain("effects: {taut_links: off}\n"));
  const auto on = folder.run("simulate {}/on.yaml"),
             off = folder.run("simulate {}/off.yaml --json {}/r.json");
  EXPECT_EQ(on.exit_code, 0);
  EXPECT_EQ(on.output.find("warning"), std::string::npos) << on.output;
  EXPECT_EQ(off.exit_code, 0);
  EXPECT_NE(off.output.find("warning: the energy rose by"), std::string::npos) << off.output;
  EXPECT_NE(off.output.find("came open by"), std::string::npos) << off.output;
  EXPECT_GT(folder.json("r.json")["closure_opened_max_m"], 0.01);
}

TEST(RunMetrics, DepthBelowTheGround) {
  const CommandFolder folder(test_name());
  folder.write("sunk.yaml",
               "gravity: [0, 0, 0]\nground: {}\nduration: 0\n"
               "models:\n  - {name: box, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.03]}\n");
  EXPECT_NEAR(folder.report("simulate {}/sunk.yaml")["end_below_ground_m"], 0.07, 1e-12);
}

TEST(RunMetrics, StopsAtTheWallLimit) {
  const CommandFolder folder(test_name());
  const auto result = folder.run(
      "simulate data/scenes/humanoid_drop.yaml --duration 1000 --wall-limit 0.05 --json {}/r.json");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("--wall-limit"), std::string::npos) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report["status"], "stopped");
  EXPECT_GT(report["steps"], 0);
  EXPECT_EQ(folder.run("simulate data/scenes/cube_drop.yaml --wall-limit 0").exit_code, 2);
}

TEST(RunMetrics, CtrlCKeepsWhatWasComputed) {
  const CommandFolder folder(test_name());
  const auto result = folder.run(
      "simulate data/scenes/pendulum.yaml --duration 1e5 --output {}/motion.csv --json {}/r.json "
      "2>{}/errors & run=$!; " +
      test::kUntilInterruptible + "sleep 0.3; kill -INT $run; wait $run");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(folder.read("errors").find("Ctrl-C"), std::string::npos) << folder.read("errors");
  const nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report["status"], "stopped");
  // The trajectory ends with a complete row and can be read.
  EXPECT_EQ(folder.report("inverse data/scenes/pendulum.yaml {}/motion.csv")["steps"],
            report["steps"]);
}

TEST(RunMetrics, ContactsAreThoseThatTheInverseFinds) {
  const CommandFolder folder(test_name());
  const std::string scene = "data/scenes/cube_drop.yaml";
  folder.succeed("simulate " + scene + " --output {}/m.csv --contacts {}/forward.csv");
  folder.succeed("inverse " + scene + " {}/m.csv --contacts {}/inverse.csv");
  EXPECT_GT(folder.lines("forward.csv"), 100);
  EXPECT_EQ(folder.read("forward.csv"), folder.read("inverse.csv"));
  // Integrators without an inverse are refused before the run starts.
  folder.refuse("simulate data/scenes/pendulum.yaml --integrator runge_kutta_4 --contacts {}/c.csv",
                "runge_kutta_4");
}

}  // namespace
}  // namespace counterpoint::run_metrics_test
