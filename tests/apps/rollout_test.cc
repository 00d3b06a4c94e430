// `counterpoint rollout`: the same bits as `simulate`, for any number of threads.
#include <gtest/gtest.h>

#include <string>

#include "apps/command.h"

namespace counterpoint::test::rollout_test {
namespace {

constexpr const char* kScene = "data/scenes/quadruped_drop.yaml --duration 0.4 --random-inputs 0.3";

TEST(Rollout, GivesTheBitsOfSimulate) {
  const CommandFolder folder(test_name());
  const CommandResult many = folder.run(std::string("rollout ") + kScene +
                                        " --count 3 --seed 5 --threads 2 --json {}/many.json");
  ASSERT_EQ(many.exit_code, 0) << many.errors;
  const auto report = folder.json("many.json");
  EXPECT_EQ(report["threads"], 2);
  EXPECT_EQ(report["steps"], 3 * 200);
  ASSERT_EQ(report["results"].size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const CommandResult one = folder.run(std::string("simulate ") + kScene + " --seed " +
                                         std::to_string(5 + i) + " --json {}/one.json");
    ASSERT_EQ(one.exit_code, 0) << one.errors;
    EXPECT_EQ(report["results"][i]["state_hash"], folder.json("one.json")["state_hash"]) << i;
  }
}

TEST(Rollout, EndsDoNotDependOnThreads) {
  const CommandFolder folder(test_name());
  for (const std::string threads : {"1", "3"}) {
    folder.succeed(std::string("rollout ") + kScene + " --count 5 --threads " + threads +
                   " --output {}/ends_" + threads + ".csv");
  }
  EXPECT_GT(folder.read("ends_1.csv").size(), 1000u);
  EXPECT_EQ(folder.read("ends_1.csv"), folder.read("ends_3.csv"));
}

// Random forces on the actuated joints of a robot in contact with the ground;
// docs/explanation/concepts.md.
TEST(Rollout, InvertsEveryStep) {
  const CommandFolder folder(test_name());
  folder.succeed(std::string("rollout ") + kScene + " --count 2 --invert --json {}/r.json");
  const auto report = folder.json("r.json");
  EXPECT_GT(report["force_scale_max"].get<double>(), 1.0);
  // The bound of the tests of `inverse`.
  EXPECT_LE(report["force_error_max"].get<double>(),
            1e-8 * report["force_scale_max"].get<double>());
}

TEST(Rollout, CtrlCKeepsWhatWasComputed) {
  const CommandFolder folder(test_name());
  // Each rollout would take an hour.
  const CommandResult result = folder.run(
      "rollout data/scenes/cube_drop.yaml --count 3 --threads 1 --duration 1e5 --output "
      "{}/ends.csv --json {}/r.json 2>{}/errors & run=$!; " +
      test::kUntilInterruptible + "sleep 0.5; kill -INT $run; wait $run");
  EXPECT_EQ(result.exit_code, 1);
  const std::string errors = folder.read("errors");
  EXPECT_NE(
      errors.find(
          "stopped by Ctrl-C or SIGTERM: 0 of 3 rollouts ended, 1 were under way, 2 not begun"),
      std::string::npos)
      << errors;
  const auto report = folder.json("r.json");
  EXPECT_EQ(report["status"], "stopped");
  EXPECT_EQ(report["finished_rollouts"], 0);
  EXPECT_EQ(report["results"][0]["status"], "stopped");
  EXPECT_GT(report["results"][0]["end_time_s"], 0.0);
  EXPECT_EQ(report["results"][1]["status"], "not begun");
  EXPECT_FALSE(report["results"][1].contains("state_hash"));
  // The header, and the state that the first rollout had reached.
  const std::string ends = folder.read("ends.csv");
  EXPECT_EQ(std::count(ends.begin(), ends.end(), '\n'), 2);
  EXPECT_NE(ends.find(report["results"][0]["state_hash"].get<std::string>()), std::string::npos);
}

TEST(Rollout, OneThatFailsLeavesTheOthers) {
  const CommandFolder folder(test_name());
  folder.write("calm.csv", "time,cube.fx\n0,0\n");
  folder.write("wild.csv", "time,cube.fx\n0,0\n0.1,1e12\n");
  const CommandResult result = folder.run(
      "rollout data/scenes/cube_drop.yaml --count 2 --duration 0.2 --inputs {}/calm.csv "
      "{}/wild.csv --json {}/r.json --output {}/ends.csv");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("rollout 1: step"), std::string::npos) << result.errors;
  const auto report = folder.json("r.json");
  EXPECT_EQ(report["failed_rollouts"], 1);
  EXPECT_EQ(report["results"][0]["status"], "ok");
  EXPECT_NEAR(report["results"][0]["end_time_s"].get<double>(), 0.2, 1e-9);
  EXPECT_EQ(report["results"][1]["status"], "failed");
  EXPECT_NEAR(report["results"][1]["end_time_s"].get<double>(), 0.1, 0.005);
}

TEST(Rollout, RefusesWhatDoesNotFit) {
  const CommandFolder folder(test_name());
  folder.write("a.csv", "time,cube.fx\n0,0\n");
  folder.refuse("rollout data/scenes/cube_drop.yaml --count 3 --inputs {}/a.csv {}/a.csv",
                "2 files for 3 rollouts");
  EXPECT_EQ(folder.run("rollout data/scenes/cube_drop.yaml --count 0").exit_code, 2);
}

}  // namespace
}  // namespace counterpoint::test::rollout_test
