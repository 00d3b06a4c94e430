// Adaptive step control on the command line: rows, reports, resumed runs, refused input.
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "apps/command.h"

namespace counterpoint::step_control_test {
namespace {

using test::CommandResult;

class StepControlCommand : public test::SimulateTest {};

TEST_F(StepControlCommand, RowsAreStepsThatTheInverseReads) {
  const std::string scene =
      "data/scenes/accuracy/double_pendulum.yaml --integrator implicit_midpoint";
  const nlohmann::json run =
      simulate(scene + " --adaptive 0.01 --duration 0.3 --random-inputs 0.5 --output {}/t.csv");
  const nlohmann::json& control = run["step_control"];
  EXPECT_EQ(run["steps"], 2 * control["accepted"].get<long>());
  EXPECT_GE(control["evaluations"], 3 * control["accepted"].get<long>());
  EXPECT_NEAR(run["simulated_seconds"], 0.3, 1e-15);
  EXPECT_LT(control["step_min_s"], control["step_max_s"]);
  const nlohmann::json inverse = folder_.report("inverse " + scene + " {}/t.csv");
  EXPECT_EQ(inverse["steps"], run["steps"]);
  // Without contacts: round-off of velocities over steps of 10 us and more.
  EXPECT_LT(inverse["applied_force_relative_error_max"], 1e-9);
}

TEST_F(StepControlCommand, TwoRunsThatMeetAtTheIntervalAreOne) {
  folder_.write("scene.yaml",
                "ground: {restitution: 0.5}\nstep_control: {tolerance: 0.01, interval: 0.5}\n"
                "models:\n  - {name: ball, sphere: 0.1, mass: 1, position: [0, 0, 0.6],\n"
                "     velocity: {linear: [1, 0, 0]}}\n");
  const auto whole = simulate("{}/scene.yaml --duration 1");
  simulate("{}/scene.yaml --duration 0.5 --save-state {}/half.csv");
  const auto second = simulate("{}/scene.yaml --duration 0.5 --resume {}/half.csv");
  EXPECT_EQ(second["state_hash"], whole["state_hash"]);
  EXPECT_EQ(second["step_control"]["next_step_s"], whole["step_control"]["next_step_s"]);
  EXPECT_GT(whole["step_control"]["impacts"], 0);
  folder_.refuse("simulate {}/scene.yaml --adaptive 0.02 --resume {}/half.csv", "control");
}

TEST_F(StepControlCommand, SaysWhatIsWrongWithIt) {
  const std::string scene = "data/scenes/pendulum.yaml";
  for (const char* wrong : {"0", "-1", "nan", "inf", "fine"})
    folder_.refuse("simulate " + scene + " --adaptive " + wrong, "expected a positive number");
  folder_.refuse("simulate " + scene + " --event-tolerance 1e-3", "--adaptive");
  folder_.refuse("simulate " + scene + " --adaptive 1e-3 --event-tolerance 1", "max_step");
  for (const auto& [text, message] :
       {std::pair<std::string, std::string>{"{tolerance: 0}", "scene.yaml:1"},
        {"{min_step: 1e-3}", "min_step <= event_tolerance <= max_step"},
        {"{tolerence: 1}", "tolerence"}}) {
    folder_.write("scene.yaml", "step_control: " + text + "\n");
    folder_.refuse("simulate {}/scene.yaml", message);
  }
}

TEST_F(StepControlCommand, AMissedToleranceIsReportedOrFails) {
  const std::string control =
      "step_control: {tolerance: 1e-9, min_step: 1e-4, event_tolerance: "
      "1e-4";
  const std::string model =
      "models:\n  - {name: ball, sphere: 0.1, mass: 1, velocity: {linear: [1, 0, 0]}}\n";
  folder_.write("lax.yaml", control + "}\n" + model);
  folder_.write("strict.yaml", control + ", strict: true}\n" + model);
  const auto lax = simulate("{}/lax.yaml --duration 0.01");
  EXPECT_EQ(lax["step_control"]["missed"], lax["step_control"]["accepted"]);
  EXPECT_GT(lax["step_control"]["missed_error_max"], 1.0);
  const CommandResult failed =
      folder_.run("simulate {}/strict.yaml --duration 0.01 --json {}/r.json");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_EQ(folder_.json("r.json")["failure"]["fault"], "tolerance");
  EXPECT_EQ(folder_.json("r.json")["failure"]["element"], "ball/body.vz");
}

}  // namespace
}  // namespace counterpoint::step_control_test
