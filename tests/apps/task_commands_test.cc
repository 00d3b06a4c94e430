// Commands that consist of tasks give the same results for every kind of worker. The tests of sweep
// and rollout are in sweep_test.cc.
#include <gtest/gtest.h>

#include <set>

#include "apps/command.h"
#include "apps/ranks.h"

namespace counterpoint::test::task_commands_test {
namespace {

using nlohmann::json;

/// Returns the report without `left_out` and without the keys that depend on workers or time.
json without(const json& report, const std::set<std::string>& left_out) {
  static const std::set<std::string> kRun = {"ranks", "threads", "computed_tasks", "wall_seconds",
                                             "tasks_per_second"};
  if (report.is_array()) {
    json out = json::array();
    for (const json& item : report) out.push_back(without(item, left_out));
    return out;
  }
  if (!report.is_object()) return report;
  json out = json::object();
  for (const auto& [key, value] : report.items())
    if (kRun.count(key) == 0 && left_out.count(key) == 0) out[key] = without(value, left_out);
  return out;
}

class TaskCommands : public testing::Test {
 protected:
  /// Runs the command by one thread and by every other kind of worker; expects the same reports
  /// and, for commands that write TABLE, the same tables. `rounds`: task lists, each of which needs
  /// all shares of the one before. `expected`: exit code.
  void expect_same_bits(const std::string& line, const std::set<std::string>& left_out,
                        int rounds = 1, int expected = 0) {
    left_out_ = left_out;
    expected_ = expected;
    run_one(line, "one", "--threads 1");
    for (const std::string threads : {"2", "3"}) {
      run_one(line, "t" + threads, "--threads " + threads);
      compare("t" + threads);
    }
    for (int round = 0; round < rounds; ++round)
      for (const std::string k : {"2", "3", "1"}) {
        const CommandResult share =
            folder_.run(named(line, "s") + " --parts {}/parts --tasks " + k + "/3");
        ASSERT_EQ(share.exit_code, 0) << share.errors;
        ASSERT_NE(share.output.find("share " + k + "/3 of "), std::string::npos) << share.output;
      }
    EXPECT_EQ(folder_.read("s.csv"), "") << "a share writes no result";
    const CommandResult merged = folder_.run("merge {}/parts");
    ASSERT_EQ(merged.exit_code, expected) << merged.errors;
    compare("s");
    if (const std::string why = why_no_mpi(folder_); !why.empty()) GTEST_SKIP() << "ranks: " << why;
    for (const std::string ranks : {"1", "2", "4"}) {
      const CommandResult result =
          shell(folder_, kMpirun + "-n " + ranks + " COMMAND " + named(line, "m" + ranks));
      ASSERT_EQ(result.exit_code, expected) << result.errors;
      compare("m" + ranks);
      EXPECT_EQ(folder_.json("m" + ranks + ".json")["ranks"], std::stoi(ranks));
    }
  }

  CommandFolder folder_{"tasks_" + test_name()};

 private:
  static std::string named(std::string line, const std::string& name) {
    const size_t at = line.find("TABLE");
    if (at != std::string::npos) line.replace(at, 5, "{}/" + name + ".csv");
    return line + " --json {}/" + name + ".json";
  }
  void run_one(const std::string& line, const std::string& name, const std::string& how) {
    const CommandResult result = folder_.run(named(line, name) + " " + how);
    ASSERT_EQ(result.exit_code, expected_) << result.errors;
  }
  void compare(const std::string& name) {
    EXPECT_EQ(without(folder_.json(name + ".json"), left_out_),
              without(folder_.json("one.json"), left_out_))
        << name;
    EXPECT_EQ(folder_.read(name + ".csv"), folder_.read("one.csv")) << name;
  }

  std::set<std::string> left_out_;
  int expected_ = 0;
};

TEST_F(TaskCommands, HardCases) {
  expect_same_bits(
      "hard-cases --no-peers --only cradle_apart --only slope_rest --only fast_spin --only coin",
      {});
}

TEST_F(TaskCommands, HardCasesWritePicturesOnRankZero) {
  const std::string cases = "hard-cases --no-peers --only cradle_apart --only slope_rest --report ";
  folder_.succeed(cases + "{}/one");
  for (const std::string k : {"1", "2"})
    folder_.succeed(cases + "{}/s --parts {}/parts --tasks " + k + "/2");
  folder_.succeed("merge {}/parts");
  EXPECT_NE(folder_.read("one/slope_rest.svg"), "");
  EXPECT_EQ(folder_.read("s/slope_rest.svg"), folder_.read("one/slope_rest.svg"));
}

// Rank 0 measures times, which vary from run to run; the keys that depend on them are left out.
TEST_F(TaskCommands, AccuracyHasTheSameErrors) {
  expect_same_bits(
      "accuracy data/scenes/accuracy/double_pendulum.yaml --vary timestep,integrator --pieces 4 "
      "--repeats 1 --duration 0.5",
      {"cost_s_per_s", "cost_least_s_per_s", "cost_most_s_per_s", "front", "physics",
       "recommendations"});
}

TEST_F(TaskCommands, OptimizeFindsTheSameBestStart) {
  // Too few iterations for any start to converge, hence exit code 1.
  expect_same_bits(
      "optimize data/scenes/optimize/acrobot.yaml --starts 4 --seed 1 --frames 12 --iterations 30 "
      "--output TABLE",
      {"newton_step_ms", "newton_linearize_ms", "newton_factor_ms", "newton_trial_ms"}, 1, 1);
}

TEST_F(TaskCommands, OptimizeGoesOnWithTheStartsThatAreMissing) {
  const std::string line =
      "optimize data/scenes/optimize/acrobot.yaml --starts 3 --frames 12 --iterations 30 --parts "
      "{}/parts --json {}/r.json";
  folder_.succeed(line + " --tasks 2/3");
  ASSERT_EQ(folder_.run(line).exit_code, 1);
  EXPECT_EQ(folder_.json("r.json")["computed_tasks"], 2);
  EXPECT_NE(folder_.run("optimize acrobot --parts {}/parts").errors.find("--starts N"),
            std::string::npos);
}

/// Records tosses of the bundled cube with other parameters than the scene's.
std::string record_tosses(const CommandFolder& folder) {
  std::string files;
  folder.write("map.yaml", free_body_map("time: time\n", "cube"));
  folder.write("study.yaml",
               "scene: cube_toss\nduration: 0.4\ntime_step: 0.01\nset: {friction: 0.3}\nvary: "
               "{cube.vx: [0.5, 1, 1.5]}\nrecord: {trajectories: true}\n");
  folder.succeed("sweep {}/study.yaml --output {}/tosses.csv");
  for (const std::string k : {"0", "1", "2"})
    files += " {}/tosses.csv.trajectories/000/00000" + k + ".csv";
  return files;
}

TEST_F(TaskCommands, IdentifyFindsTheSameFigures) {
  const std::string recordings = record_tosses(folder_);
  expect_same_bits("identify cube_toss" + recordings +
                       " --columns {}/map.yaml --parameters friction=0.1..0.9,mass --samples 10 "
                       "--refined 2 --bootstrap 4 --train 1",
                   {}, 3);
}

TEST_F(TaskCommands, IdentifyGoesOnWhereItWasStopped) {
  const std::string recordings = record_tosses(folder_);
  const std::string line = "identify cube_toss" + recordings +
                           " --columns {}/map.yaml --parameters friction=0.1..0.9 --samples 6 "
                           "--train 1 --parts {}/parts --json ";
  // Runs the first share of the first task list, then everything.
  folder_.succeed(line + "{}/s.json --tasks 1/2");
  EXPECT_EQ(folder_.json("s.json")["status"], "incomplete");
  EXPECT_EQ(folder_.json("s.json")["computed_tasks"], 4) << "the start and every second sample";
  folder_.succeed(line + "{}/all.json");
  folder_.succeed(line + "{}/again.json");
  EXPECT_EQ(folder_.read("again.json"), folder_.read("all.json"));
  // Results from other recordings are not reused.
  folder_.write("tosses.csv.trajectories/000/000001.csv",
                folder_.read("tosses.csv.trajectories/000/000002.csv"));
  EXPECT_NE(folder_.run(line + "{}/other.json").errors.find("finished tasks of something else"),
            std::string::npos);
}

TEST_F(TaskCommands, ResultsOfOtherInputsAreRefused) {
  folder_.write("push.csv", "time,cube.fx\n0,1\n");
  const std::string line =
      "rollout cube_drop --duration 0.1 --count 2 --inputs {}/push.csv --parts {}/parts";
  folder_.succeed(line);
  folder_.write("push.csv", "time,cube.fx\n0,2\n");
  folder_.refuse(line, "finished tasks of something else");
}

}  // namespace
}  // namespace counterpoint::test::task_commands_test
