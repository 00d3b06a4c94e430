// `counterpoint sweep` and `merge`: the same table for every division of the work and after every
// interruption.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <numbers>
#include <sstream>
#include <thread>

#include "apps/command.h"
#include "apps/ranks.h"
#include "counterpoint/engine/tables.h"

namespace counterpoint::test::sweep_test {
namespace {

namespace fs = std::filesystem;

/// A study of 8 draws tasks of about 10 ms each.
std::string study(int draws = 3) {
  return "scene: cube_toss\nduration: 0.3\nseed: 4\ndraws: " + std::to_string(draws) +
         "\nvary:\n  friction: {from: 0.1, to: 0.4, points: 4}\n  friction_model: [coulomb, "
         "convex]\n"
         "  cube.vx: {uniform: [0.5, 1.5]}\n  cube.yaw: {uniform: [-3, 3]}\n"
         "record:\n  columns: [max(cube.z), mean(cube.vx)]\n  figures: [max_penetration_m, "
         "energy_end_J]\n";
}

class Sweep : public testing::Test {
 protected:
  void SetUp() override { folder_.write("study.yaml", study()); }
  /// Returns the table computed by one thread.
  std::string expected(const CommandFolder& folder) {
    folder.succeed("sweep {}/study.yaml --output {}/expected.csv --threads 1");
    return folder.read("expected.csv");
  }
  void expect_bad(const std::string& yaml, const std::string& message) {
    folder_.write("bad.yaml", yaml);
    folder_.refuse("sweep {}/bad.yaml --output {}/bad.csv", message);
    EXPECT_FALSE(fs::exists(folder_.path("bad.csv.parts"))) << "nothing was to be begun";
  }
  CommandFolder folder_{"sweep_" + test_name()};
};

TEST_F(Sweep, TheTableHasARowATaskWithAllThatWasVaried) {
  expected(folder_);
  const std::string text = folder_.read("expected.csv");
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "task,status,reason,friction,friction_model,cube.vx,cube.yaw,draw,steps,end_time_s,"
            "state_hash,"
            "cube.x,cube.y,cube.z,cube.qw,cube.qx,cube.qy,cube.qz,end(cube.vx),cube.vy,cube.vz,"
            "cube.wx,cube.wy,"
            "cube.wz,max(cube.z),mean(cube.vx),max_penetration_m,energy_end_J");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 4 * 2 * 3);
  // Draws vary fastest, then the last axis; a draw is the same at every point of the grid.
  const auto begin = [&](int row) {
    size_t at = 0;
    for (int i = 0; i <= row; ++i) at = text.find('\n', at) + 1;
    return text.substr(at, text.find('\n', at) - at);
  };
  EXPECT_EQ(begin(0).rfind("0,ok,,0.10000000000000001,coulomb,", 0), 0u) << begin(0);
  EXPECT_EQ(begin(3).rfind("3,ok,,0.10000000000000001,convex,", 0), 0u) << begin(3);
  EXPECT_EQ(begin(23).rfind("23,ok,,0.40000000000000002,convex,", 0), 0u) << begin(23);
  const auto draws = [](const std::string& row) {
    return row.substr(row.find("co"), 60).substr(8);
  };
  EXPECT_EQ(draws(begin(0)).substr(0, 30), draws(begin(6)).substr(0, 30));
  EXPECT_NE(folder_.read("expected.html").find("max(cube.z) over friction"), std::string::npos);
}

TEST_F(Sweep, ATaskGivesTheBitsOfSimulate) {
  folder_.write("study.yaml",
                "scene: quadruped_drop\nduration: 0.2\nseed: 5\ndraws: 2\nrandom_inputs: "
                "0.3\nvary:\n  time_step: [0.002, 0.004]\n");
  expected(folder_);
  // Task 3: the longer step, draw 1, hence seed 5 + 1.
  const auto one = folder_.run(
      "simulate quadruped_drop --duration 0.2 --timestep 0.004 --random-inputs 0.3 --seed 6 --json "
      "{}/r.json");
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  const std::string hash = folder_.json("r.json")["state_hash"];
  const std::string text = folder_.read("expected.csv");
  EXPECT_NE(text.substr(text.find("\n3,ok")).find("," + hash + ","), std::string::npos);
}

TEST_F(Sweep, FiguresGoBeforePresetsWhateverTheirOrder) {
  const auto ends_of = [&](const std::string& axes) {
    folder_.write("study.yaml", "scene: cube_toss\nduration: 0.3\nvary:\n" + axes);
    fs::remove_all(folder_.path("expected.csv.parts"));
    expected(folder_);
    std::istringstream rows(folder_.read("expected.csv"));
    std::vector<std::string> ends;  // per row, the cells after the varied ones
    for (std::string row; std::getline(rows, row);) {
      size_t at = 0;
      for (int comma = 0; comma < 5; ++comma) at = row.find(',', at) + 1;
      ends.push_back(row.substr(at));
    }
    return ends;
  };
  const std::vector<std::string> ends =
      ends_of("  compliance: [1e-6, 1e-4, 1e-6]\n  contact: [hard]\n");
  EXPECT_EQ(ends, ends_of("  contact: [hard]\n  compliance: [1e-6, 1e-4, 1e-6]\n"));
  ASSERT_EQ(ends.size(), 4u);
  EXPECT_NE(ends[1], ends[2]);
  EXPECT_EQ(ends[1], ends[3]) << "a worker's scene is that of its task";
}

TEST_F(Sweep, ThreadsAndSharesGiveTheSameBits) {
  const std::string table = expected(folder_);
  for (const std::string threads : {"2", "3"}) {
    folder_.succeed("sweep {}/study.yaml --output {}/t" + threads + ".csv --threads " + threads);
    EXPECT_EQ(folder_.read("t" + threads + ".csv"), table) << threads;
  }
  for (const std::string k : {"2", "3", "1"}) {
    const CommandResult early = folder_.run("merge {}/s.csv.parts");
    EXPECT_NE(early.exit_code, 0) << "shares are missing";
    folder_.succeed("sweep {}/study.yaml --output {}/s.csv --tasks " + k + "/3");
    EXPECT_FALSE(fs::exists(folder_.path("s.csv")));
  }
  folder_.succeed("merge {}/s.csv.parts");
  EXPECT_EQ(folder_.read("s.csv"), table);
}

TEST_F(Sweep, SharesOfMachinesWithoutACommonDiskAreMerged) {
  const std::string table = expected(folder_);
  for (const std::string k : {"1", "2"})
    folder_.succeed("sweep {}/study.yaml --output {}/s.csv --parts {}/machine" + k + " --tasks " +
                    k + "/2");
  folder_.succeed("merge {}/machine1 {}/machine2");
  EXPECT_EQ(folder_.read("s.csv"), table);
}

TEST_F(Sweep, RanksGiveTheSameBits) {
  if (const std::string why = why_no_mpi(folder_); !why.empty()) GTEST_SKIP() << why;
  const std::string table = expected(folder_);
  for (const std::string ranks : {"1", "2", "4"}) {
    const CommandResult result =
        shell(folder_, kMpirun + "-n " + ranks + " COMMAND sweep {}/study.yaml --output {}/m" +
                           ranks + ".csv --json {}/m.json");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(folder_.read("m" + ranks + ".csv"), table) << ranks;
    EXPECT_EQ(folder_.json("m.json")["ranks"], std::stoi(ranks));
  }
}

TEST_F(Sweep, RolloutGivesTheSameBitsOnRanksAndShares) {
  const std::string line =
      "rollout quadruped_drop --duration 0.2 --random-inputs 0.3 --count 9 --output ";
  folder_.succeed(line + "{}/one.csv --threads 1");
  for (const std::string k : {"1", "2"})
    folder_.succeed(line + "{}/s.csv --parts {}/parts --tasks " + k + "/2");
  folder_.succeed("merge {}/parts");
  EXPECT_EQ(folder_.read("s.csv"), folder_.read("one.csv"));
  if (const std::string why = why_no_mpi(folder_); !why.empty()) GTEST_SKIP() << "ranks: " << why;
  for (const std::string ranks : {"2", "4"}) {
    ASSERT_EQ(shell(folder_, kMpirun + "-n " + ranks + " COMMAND " + line + "{}/m.csv").exit_code,
              0);
    EXPECT_EQ(folder_.read("m.csv"), folder_.read("one.csv")) << ranks;
  }
}

TEST_F(Sweep, ARankThatDiesLosesItsUnfinishedTasksOnly) {
  if (const std::string why = why_no_mpi(folder_); !why.empty()) GTEST_SKIP() << why;
  folder_.write("study.yaml", study(60));  // takes some seconds
  const std::string table = expected(folder_);
  // Kills the first rank once a journal has some finished tasks.
  const CommandResult killed =
      shell(folder_, kMpirun +
                         "-n 2 COMMAND sweep {}/study.yaml --output {}/k.csv & run=$!; "
                         "until [ $(cat {}/k.csv.parts/*.journal 2>/dev/null | wc -c) -gt 8000 ]; "
                         "do sleep 0.02; done; "
                         "mpi=$(cat /proc/$run/task/$run/children); rank=$(cat /proc/${mpi%% "
                         "*}/task/${mpi%% *}/children); "
                         "kill -9 ${rank%% *}; wait $run");
  ASSERT_NE(killed.exit_code, 0) << killed.output;
  ASSERT_FALSE(fs::exists(folder_.path("k.csv")));
  folder_.succeed("sweep {}/study.yaml --output {}/k.csv --json {}/k.json");
  EXPECT_EQ(folder_.read("k.csv"), table);
  const auto report = folder_.json("k.json");
  EXPECT_LT(report["computed_tasks"], report["tasks"]) << "finished tasks were lost";
  EXPECT_GT(report["computed_tasks"], 0) << "it was not killed in mid-run";
}

TEST_F(Sweep, CtrlCKeepsWhatIsDoneAndTheSameCommandGoesOn) {
  folder_.write("study.yaml", study(60));
  const CommandResult stopped = shell(folder_,
                                      "COMMAND sweep {}/study.yaml --output {}/c.csv & run=$!; "
                                      "until [ $(cat {}/c.csv.parts/*.journal 2>/dev/null | wc -c) "
                                      "-gt 4000 ]; do sleep 0.02; done; "
                                      "kill -TERM $run; wait $run");
  EXPECT_EQ(stopped.exit_code, 1);
  EXPECT_NE(stopped.errors.find("the same command goes on"), std::string::npos) << stopped.errors;
  folder_.succeed("sweep {}/study.yaml --output {}/c.csv");
  EXPECT_EQ(folder_.read("c.csv"), expected(folder_));
}

TEST_F(Sweep, AFullDiskIsSaidAndNothingIsLost) {
  const std::string table = expected(folder_);
  // A file may have 2 KiB (4 blocks of 512 bytes), room for some tasks only.
  const CommandResult full =
      shell(folder_, "ulimit -f 4; COMMAND sweep {}/study.yaml --output {}/f.csv --threads 1");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_NE(full.errors.find(": File too large"), std::string::npos) << full.errors;
  EXPECT_NE(full.errors.find("goes on"), std::string::npos) << full.errors;
  folder_.succeed("sweep {}/study.yaml --output {}/f.csv --json {}/f.json");
  EXPECT_EQ(folder_.read("f.csv"), table);
  EXPECT_LT(folder_.json("f.json")["computed_tasks"], 24);
  // If the table itself cannot be written, the existing one stays.
  const CommandResult table_full =
      shell(folder_, "ulimit -f 4; COMMAND sweep {}/study.yaml --output {}/f.csv");
  EXPECT_EQ(table_full.exit_code, 1) << table_full.errors;
  EXPECT_EQ(folder_.read("f.csv"), table);
}

// A 16 KiB disk fills up during the run, then is enlarged; over MPI ranks where available.
TEST_F(Sweep, AFullDiskKeepsFinishedTasksAndRanksGoOn) {
  if (shell(folder_, "unshare -rm mount -t tmpfs tmpfs {}").exit_code != 0)
    GTEST_SKIP() << "no disk of a few KiB can be mounted here (unshare -rm)";
  folder_.write("study.yaml", study(15));  // 120 rows of about 250 bytes
  const std::string table = expected(folder_);
  const std::string ranks = why_no_mpi(folder_).empty() ? kMpirun + "-n 2 " : "";
  const std::string sweep = "COMMAND sweep {}/study.yaml --output {}/disk/f.csv --json {}/f.json";
  const CommandResult result =
      shell(folder_,
            "mkdir {}/disk; unshare -rm sh -c '"
            "mount -t tmpfs -o size=16k tmpfs {}/disk; " +
                ranks + sweep + "; echo code $?; mount -o remount,size=4m {}/disk; " + ranks +
                sweep + "; cp {}/disk/f.csv {}/f.csv'");
  EXPECT_NE(result.output.find("code 1"), std::string::npos) << result.output;
  EXPECT_NE(result.errors.find("No space left on device"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("goes on"), std::string::npos) << result.errors;
  EXPECT_EQ(folder_.read("f.csv"), table) << result.errors;
  EXPECT_LT(folder_.json("f.json")["computed_tasks"], 120) << "finished tasks were lost";
}

// An unwritable trajectory is not a failure of its task and gives no row; once the path is free,
// the same command continues.
TEST_F(Sweep, TrajectoriesThatCannotBeWrittenEndTheRun) {
  folder_.write(
      "study.yaml",
      "scene: cube_toss\nduration: 0.1\nvary:\n  cube.vx: [0, 1]\nrecord: {trajectories: true}\n");
  folder_.write("t.csv.trajectories", "in the way");
  const CommandResult result = folder_.run("sweep {}/study.yaml --output {}/t.csv");
  EXPECT_NE(result.exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_.path("t.csv")));
  fs::remove(folder_.path("t.csv.trajectories"));
  folder_.succeed("sweep {}/study.yaml --output {}/t.csv");
  EXPECT_EQ(Table(folder_.path("t.csv.trajectories/000/000001.csv")).num_rows(), 51);
}

TEST_F(Sweep, AFolderThatCannotBeWrittenIsSaidBeforeAnyWork) {
  // A folder that not even root can write to.
  folder_.refuse("sweep {}/study.yaml --output /sys/kernel/table.csv",
                 "finished tasks cannot be kept here");
}

TEST_F(Sweep, ATaskThatFailsIsARowWithItsReason) {
  folder_.write("study.yaml",
                "scene: cube_drop\nduration: 0.1\nvary:\n  cube.vx: [0, 1e12]\n  mass:cube: [1]\n");
  const CommandResult result =
      folder_.run("sweep {}/study.yaml --output {}/t.csv --json {}/r.json");
  EXPECT_EQ(result.exit_code, 1);
  const auto report = folder_.json("r.json");
  EXPECT_EQ(report["failed_tasks"], 1);
  EXPECT_EQ(report["failures"][0]["task"], 1);
  const std::string text = folder_.read("t.csv");
  EXPECT_NE(text.find("\n0,ok,,0,1,"), std::string::npos) << text;
  EXPECT_NE(text.find("\n1,failed,"), std::string::npos) << text;
}

TEST_F(Sweep, AnotherStudyIsNotMixedIn) {
  expected(folder_);
  folder_.write("study.yaml", study(4));
  folder_.refuse("sweep {}/study.yaml --output {}/expected.csv",
                 "finished tasks of something else");
}

TEST_F(Sweep, BadStudiesAreRefusedByLine) {
  expect_bad("scene: nowhere.yaml\nvary: {friction: [1]}\n", "bad.yaml:1: ");
  expect_bad("scene: cube_toss\nvary:\n  fiction: [1]\n", "bad.yaml:3: ");
  expect_bad("scene: cube_toss\nvary:\n  friction: [0.1, -1]\n", "bad.yaml:3: ");
  expect_bad("scene: cube_toss\nvary:\n  friction: {from: 0, to: 1}\n", "'points' is missing");
  expect_bad("scene: cube_toss\nvary:\n  friction: {uniform: [2, 1]}\n", "expected LOW below HIGH");
  expect_bad("scene: cube_toss\nvary:\n  cube.qw: [1]\n", "use cube.roll");
  expect_bad("scene: cube_toss\nvary:\n  integrator: [euler]\n", "there is no 'euler'");
  expect_bad("scene: cube_toss\ndraws: 3\nvary:\n  friction: [0.1]\n", "nothing is random");
  expect_bad("scene: cube_toss\nvary:\n  friction: [0.1]\nrecord: {columns: [cube.zz]}\n",
             "'cube.zz' is no coordinate");
  expect_bad("scene: cube_toss\nvary:\n  friction: [0.1]\nrecord: {figures: [wall_seconds]}\n",
             "not the same twice");
  expect_bad("scene: cube_toss\nvary:\n  friction: [0.1]\nrecord: {figures: [speed]}\n",
             "there is no 'speed'");
  expect_bad("scene: cube_toss\nvary:\n  inputs: [nowhere.csv]\n", "there is no file");
}

TEST_F(Sweep, BadSharesAreRefused) {
  for (const std::string share : {"0/3", "4/3", "3", "x/2", "1/0"}) {
    folder_.refuse("sweep {}/study.yaml --output {}/t.csv --tasks " + share, "expected K/N");
  }
  EXPECT_NE(folder_.run("rollout cube_toss --tasks 1/2").errors.find("--parts DIR"),
            std::string::npos);
  EXPECT_NE(folder_.run("merge {}").errors.find("command.json is missing"), std::string::npos);
}

TEST_F(Sweep, HoldsTheSameNumbersInHdf5) {
  expected(folder_);
  const CommandResult result = folder_.run("sweep {}/study.yaml --output {}/table.h5 --threads 2");
  if (result.errors.find("libhdf5-dev") != std::string::npos) GTEST_SKIP() << result.errors;
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Table table(folder_.path("table.h5"));
  ASSERT_EQ(table.num_rows(), 24);
  const std::string text = folder_.read("expected.csv");
  for (const char* name : {"friction", "cube.vx", "cube.z", "max(cube.z)", "energy_end_J"}) {
    const double value = table.value(23, table.column(name));
    EXPECT_NE(text.substr(text.find("\n23,ok")).find(fmt::format(",{:.17g}", value)),
              std::string::npos)
        << name;
  }
}

TEST_F(Sweep, TrajectoriesAreThoseOfTheRows) {
  folder_.write(
      "study.yaml",
      "scene: cube_toss\nduration: 0.1\nvary:\n  cube.vx: [0, 1]\nrecord: {trajectories: true}\n");
  expected(folder_);
  const Table motion(folder_.path("expected.csv.trajectories/000/000001.csv"));
  EXPECT_EQ(motion.num_rows(), 51);
  EXPECT_EQ(motion.value(0, motion.column("cube.vx")), 1.0);
}

}  // namespace
}  // namespace counterpoint::test::sweep_test
