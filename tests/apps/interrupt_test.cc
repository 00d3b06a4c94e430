// Ctrl-C ends a run in order: results so far are written and the user is told. The tests of
// simulate and rollout are beside their other tests.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "apps/command.h"

namespace counterpoint::interrupt_test {
namespace {

using test::CommandFolder;
using test::CommandResult;
using test::test_name;

/// The promised second, plus an allowance for a loaded machine [s].
constexpr double kMostSeconds = 1.0 + 2.0;

/// Runs a command that would take minutes, and sends a signal 0.5 s after it has installed its
/// handler.
CommandResult interrupted(const CommandFolder& folder, const std::string& arguments,
                          const std::string& signal = "INT") {
  CommandResult result =
      folder.run(arguments + " --json {}/r.json 2>{}/errors & run=$!; " +
                 test::kUntilInterruptible + "sleep 0.5; date +%s.%N >{}/sent; kill -" + signal +
                 " $run; wait $run; code=$?; "
                 "date +%s.%N >{}/ended; exit $code");
  result.errors = folder.read("errors");
  EXPECT_LT(std::stod(folder.read("ended")) - std::stod(folder.read("sent")), kMostSeconds)
      << arguments;
  EXPECT_EQ(result.exit_code, 1) << result.errors;
  EXPECT_NE(result.errors.find("by Ctrl-C"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.json("r.json")["status"], "stopped");
  return result;
}

/// Writes tosses of the bundled cube as recordings, and their column map.
void record_tosses(const CommandFolder& folder) {
  folder.succeed(
      "simulate data/scenes/cube_drop.yaml --duration 0.4 --timestep 0.02 "
      "--output {}/toss.csv");
  folder.write("map.yaml", test::free_body_map("time: time\n", "cube"));
}

TEST(Interrupt, DerivativesHasTheStepsSoFar) {
  const CommandFolder folder(test_name());
  folder.succeed(
      "simulate data/scenes/humanoid_drop.yaml --duration 2 --timestep 1e-3 "
      "--output {}/m.csv");
  const CommandResult result =
      interrupted(folder, "derivatives data/scenes/humanoid_drop.yaml {}/m.csv --check");
  const long steps = folder.json("r.json")["steps"];
  EXPECT_LT(steps, 2000);
  EXPECT_NE(result.errors.find(fmt::format("after {} of 2000 steps", steps)), std::string::npos)
      << result.errors;
}

TEST(Interrupt, CompareHasTheRecordingsSoFar) {
  const CommandFolder folder(test_name());
  record_tosses(folder);
  // The first recording is short; the second takes minutes and is left out of the report.
  folder.write("short.csv", [&] {
    const std::string all = folder.read("toss.csv");
    size_t end = 0;
    for (int line = 0; line < 3; ++line) end = all.find('\n', end) + 1;
    return all.substr(0, end);
  }());
  const CommandResult result = interrupted(
      folder,
      "compare data/scenes/cube_drop.yaml {}/short.csv {}/toss.csv {}/toss.csv --columns "
      "{}/map.yaml --substeps 20000 --output {}/rows.csv");
  const auto report = folder.json("r.json");
  EXPECT_LT(report["recordings"].size(), 3u);
  EXPECT_NE(result.errors.find(fmt::format("{} of 3 recordings", report["recordings"].size())),
            std::string::npos)
      << result.errors;
}

TEST(Interrupt, IdentifyHasTheBestSoFar) {
  const CommandFolder folder(test_name());
  record_tosses(folder);
  interrupted(folder,
              "identify data/scenes/cube_drop.yaml {}/toss.csv --columns {}/map.yaml "
              "--parameters friction=0.1..0.9 --samples 1000000 --substeps 10");
  const auto report = folder.json("r.json");
  ASSERT_EQ(report["parameters"].size(), 1u);
  EXPECT_LE(report["cost"].get<double>(), report["start_cost"].get<double>());
  EXPECT_GT(report["evaluations"].get<int>(), 1);
}

TEST(Interrupt, IdentifyHasTheFoldsSoFar) {
  const CommandFolder folder(test_name());
  record_tosses(folder);
  // The first fold takes minutes.
  const CommandResult result =
      interrupted(folder,
                  "identify data/scenes/cube_drop.yaml {}/toss.csv {}/toss.csv --columns "
                  "{}/map.yaml --parameters friction=0.1..0.9 --samples 1000000 --substeps 10 "
                  "--folds 2");
  EXPECT_NE(result.errors.find("those of the folds that were finished"), std::string::npos)
      << result.errors;
  const auto report = folder.json("r.json");
  EXPECT_TRUE(report["folds"].is_array());
  EXPECT_TRUE(report["folds"].empty());
  EXPECT_FALSE(report.contains("parameters"));
}

TEST(Interrupt, AccuracyHasTheSettingsSoFar) {
  const CommandFolder folder(test_name());
  interrupted(folder,
              "accuracy data/scenes/pendulum.yaml --vary integrator --duration 0.2 --pieces 2 "
              "--finer 8 --repeats 10000 --report {}/page");
  EXPECT_NE(folder.read("page/accuracy.html").find("<svg"), std::string::npos);
}

TEST(Interrupt, HardCasesHasTheCasesSoFar) {
  const CommandFolder folder(test_name());
  const CommandResult result = interrupted(folder,
                                           "hard-cases --no-peers --report {}/page "
                                           "$(yes -- '--only cradle_apart' | head -2000)");
  const size_t cases = folder.json("r.json")["cases"].size();
  EXPECT_LT(cases, 2000u);
  EXPECT_NE(result.errors.find(fmt::format("{} of 2000 cases", cases)), std::string::npos)
      << result.errors;
  EXPECT_GT(folder.lines("page/hard-cases.md"), 0);
}

TEST(Interrupt, ExplainHasTheMotionSoFar) {
  const CommandFolder folder(test_name());
  folder.succeed("simulate data/scenes/quadruped_drop.yaml --duration 1.8 --output {}/m.csv");
  std::string map = "time: time\ncolumns:\n", head = folder.read("m.csv");
  std::replace(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(head.find('\n')), ',',
               '\n');
  std::istringstream names(head);
  for (std::string name; std::getline(names, name) && name != "trunk.vx";)
    if (name.ends_with(".q") || name.starts_with("trunk."))
      map += fmt::format("  {0}: {0}\n", name);
  folder.write("map.yaml", map);
  interrupted(folder,
              "explain data/scenes/quadruped_drop.yaml {}/m.csv --columns {}/map.yaml "
              "--errors white --threads 1 --output {}/motion.csv");
  EXPECT_GT(folder.lines("motion.csv"), 900);
}

TEST(Interrupt, OptimizeHasTheMotionSoFar) {
  const CommandFolder folder(test_name());
  interrupted(folder, "optimize humanoid_walk --threads 1 --output {}/walk.csv");
  EXPECT_GT(folder.lines("walk.csv"), 10);
}

// A single row, recording, point or piece takes minutes; the signal must not wait for its end.
TEST(Interrupt, EndsWhateverTakesMinutesWithinASecond) {
  const CommandFolder folder(test_name());
  record_tosses(folder);
  const std::string recorded =
      "data/scenes/cube_drop.yaml {}/toss.csv --columns {}/map.yaml --substeps 1000000";
  interrupted(folder, "compare " + recorded);
  interrupted(folder, "compare " + recorded, "TERM");
  interrupted(folder, "identify " + recorded + " --parameters friction=0.1..0.9");
  const auto found = folder.json("r.json");
  EXPECT_EQ(found["parameters"].size(), 1u) << "what there was: the scene's own";
  interrupted(folder,
              "accuracy data/scenes/pendulum.yaml --vary integrator --duration 50 --pieces 1 "
              "--finer 2 --repeats 1");
  interrupted(folder, "simulate data/scenes/piles/pile_200.yaml --duration 1000");
}

}  // namespace
}  // namespace counterpoint::interrupt_test
