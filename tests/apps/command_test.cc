// The command line as users meet it: exit codes, messages, the keys of reports.
#include "apps/command.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "counterpoint/engine/tables.h"
#include "support/paths.h"

namespace counterpoint::command_test {
namespace {

using test::CommandFolder;
using test::CommandResult;
using test::test_name;

class Command : public testing::Test {
 protected:
  void expect_keys(const nlohmann::json& report, const std::vector<std::string>& keys) const {
    for (const std::string& key : keys) EXPECT_TRUE(report.contains(key)) << key;
  }
  /// A free cube without gravity or ground, time step 0.01 s, for 0.5 s.
  void write_free_cube() const {
    folder_.write("free.yaml",
                  "name: free\ngravity: [0, 0, 0]\ntime_step: 0.01\nduration: 0.5\n"
                  "models:\n  - urdf: " +
                      test::source_dir() + "/data/robots/cube.urdf\n    base: floating\n");
  }

  CommandFolder folder_{test_name()};
};

TEST_F(Command, HelpAndVersionSucceed) {
  expect_keys(folder_.report("--version"),
              {"version", "format", "compiler", "build", "eigen", "processor", "replay_pages",
               "hdf5", "sdf", "mpi", "mujoco"});
  for (const char* name : {"simulate", "inverse", "compare", "inspect", "contact-problem"}) {
    const CommandResult result = folder_.run(std::string(name) + " --help");
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.output.find("Example:"), std::string::npos) << name;
    EXPECT_NE(result.output.find("--json"), std::string::npos) << name;
  }
}

TEST_F(Command, RefusesBadInput) {
  folder_.refuse("", "subcommand");
  folder_.refuse("fly", "subcommand");
  folder_.refuse("simulate", "SCENE");
  folder_.refuse("simulate no/such/scene.yaml", "no/such/scene.yaml");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --timestep 0", "time step");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --timestep x", "--timestep");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --duration=-1", "duration");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --output {}/no/t.csv", "cannot be created");
  folder_.refuse("inspect data/robots/cube.urdf --base sideways", "--base");
  folder_.refuse("inspect data/robots/cube.urdf --package robots", "NAME=DIR");
  folder_.refuse("inverse data/scenes/cube_drop.yaml {}/none.csv", "none.csv");
}

TEST_F(Command, SaysWhichColumnOfTheInputsIsWrong) {
  write_free_cube();
  folder_.write("u.csv", "time,cube.fx\n0,1\n0.1,one\n");
  folder_.refuse("simulate {}/free.yaml --inputs {}/u.csv", "u.csv:3: column 'cube.fx'");
  folder_.write("u.csv", "time,elbow.u\n0,1\n");
  folder_.refuse("simulate {}/free.yaml --inputs {}/u.csv", "'elbow.u' is no applied force");
  folder_.write("u.csv", "time\n0\n");
  folder_.refuse("simulate {}/free.yaml --inputs {}/u.csv", "no applied force among the columns");
}

TEST_F(Command, SimulateReports) {
  const nlohmann::json report = folder_.report(
      "simulate data/scenes/cube_drop.yaml --duration 1 --timestep 0.002 --output {}/t.csv");
  expect_keys(report, {"status", "steps", "simulated_seconds", "wall_seconds", "realtime_factor",
                       "contacts_mean", "newton_iterations_mean", "solver_failures",
                       "max_penetration_m", "energy_start_J", "energy_end_J"});
  EXPECT_EQ(report["status"], "ok");
  EXPECT_EQ(report["steps"], 500);
  EXPECT_NEAR(report["simulated_seconds"], 1.0, 1e-9);  // round-off of a sum of 500 steps
  EXPECT_EQ(report["solver_failures"], 0);
  EXPECT_GT(report["contacts_mean"], 0.0);
  EXPECT_EQ(folder_.lines("t.csv"), 502);  // header, 501 states
}

TEST_F(Command, SimulateReportsTheKineticEnergy) {
  // A box of 1 kg with half lengths 0.1, 0.2 and 0.3 m rotates at (0.01, 5, 0.01) rad/s without
  // translation.
  const double known = 0.5 / 3 * (0.13 * 1e-4 + 0.1 * 25 + 0.05 * 1e-4);
  EXPECT_NEAR(
      folder_.report("simulate data/scenes/hard/dzhanibekov.yaml --duration 0.01 --output {}/t.csv")
          ["energy_start_J"],
      known, 1e-12);  // round-off
}

TEST_F(Command, AReportOnStandardOutputStandsAlone) {
  const CommandResult result =
      folder_.run("simulate data/scenes/cube_drop.yaml --duration 0.01 --json -");
  EXPECT_EQ(nlohmann::json::parse(result.output)["steps"], 5);  // throws if there is more text
  EXPECT_NE(result.errors.find("5 steps"), std::string::npos);
}

TEST_F(Command, SameInputGivesTheSameBytes) {
  const std::string run =
      "simulate data/scenes/quadruped_drop.yaml --duration 0.6 --random-inputs 0.5 "
      "--random-wrenches 0.1 --seed 7 --output {}/";
  folder_.succeed(run + "a.csv");
  folder_.succeed(run + "b.csv");
  ASSERT_GT(folder_.read("a.csv").size(), 1000u);
  EXPECT_EQ(folder_.read("a.csv"), folder_.read("b.csv"));
  folder_.succeed(
      "simulate data/scenes/quadruped_drop.yaml --duration 0.6 --random-inputs 0.5 "
      "--random-wrenches 0.1 --seed 8 --output {}/c.csv");
  EXPECT_NE(folder_.read("a.csv"), folder_.read("c.csv"));
}

TEST_F(Command, AppliedForcesHoldFromTheirRowToTheNext) {
  write_free_cube();
  // 2 N on 1 kg from 0.1 to 0.2 s: ten steps of 0.01 s.
  folder_.write("u.csv", "time,cube.fx\n0.1,2\n0.2,0\n");
  folder_.succeed("simulate {}/free.yaml --inputs {}/u.csv --output {}/t.csv");
  const Table motion(folder_.path("t.csv"));
  EXPECT_NEAR(motion.value(motion.num_rows() - 1, motion.column("cube.vx")), 0.2,
              1e-14);  // round-off of ten additions
}

TEST_F(Command, AFailedStepKeepsWhatWasComputed) {
  write_free_cube();
  folder_.write("u.csv", "time,cube.fx\n0.1,1e308\n");
  const CommandResult result = folder_.run(
      "simulate {}/free.yaml --timestep 10 --duration 100 --inputs {}/u.csv --output {}/t.csv "
      "--json "
      "{}/r.json");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("step 1 at 10 s"), std::string::npos) << result.errors;
  const nlohmann::json report = folder_.json("r.json");
  EXPECT_EQ(report["status"], "failed");
  EXPECT_EQ(report["solver_failures"], 1);
  EXPECT_EQ(folder_.lines("t.csv"), 3);  // header, two states
}

TEST_F(Command, InspectCountsTheHumanoid) {
  const nlohmann::json report = folder_.report("inspect data/scenes/humanoid_drop.yaml");
  EXPECT_EQ(report["nv"], 31);
  EXPECT_EQ(report["joints"].size(), 26u);
  EXPECT_NEAR(report["mass_kg"], 63.6, 1e-9);  // the sum of the masses in the file
  for (const auto& joint : report["joints"]) {
    if (joint["type"] != "revolute") continue;
    EXPECT_TRUE(joint["lower"].is_number() && joint["upper"].is_number()) << joint["name"];
  }
  EXPECT_EQ(report["coordinates"]["force"].size(), 31u);
}

TEST_F(Command, InspectListsTheSurfacesThatPairsEndUpWith) {
  folder_.write(
      "s.yaml",
      "ground: {friction: 0.5, torsional_friction: 0.01}\n"
      "models:\n"
      "  - {name: a, sphere: 0.1, mass: 1, position: [0, 0, 1], rolling_friction: 0.002}\n"
      "  - {name: b, sphere: 0.1, mass: 1, position: [1, 0, 1]}\n"
      "pairs: [{between: [ground, b/body], friction: 0.3}]\n");
  const nlohmann::json report = folder_.report("inspect {}/s.yaml");
  const auto surfaces = report["surfaces"];
  ASSERT_EQ(surfaces.size(), 3u);  // ordered by friction
  const auto between = [](const char* a, const char* b) { return nlohmann::json{a, b}; };
  EXPECT_EQ(surfaces[0]["between"], between("b/body/shape", "ground"));
  EXPECT_EQ(surfaces[0]["friction"], 0.3);
  EXPECT_EQ(surfaces[0]["torsional_friction_m"], 0.01);  // the larger of the two geometries' values
  EXPECT_EQ(surfaces[0]["rolling_friction_m"], 0.0);
  EXPECT_EQ(surfaces[1]["between"], between("a/body/shape", "ground"));
  EXPECT_EQ(surfaces[1]["rolling_friction_m"], 0.002);
  EXPECT_EQ(surfaces[2]["between"], between("a/body/shape", "b/body/shape"));
  EXPECT_EQ(surfaces[2]["pairs"], 1);
}

TEST_F(Command, InspectSaysWhyPairsAreLeftOutAndWhatIsConcave) {
  const std::string link = R"(<inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry>)";
  const std::string ball = R"(<sphere radius="0.6"/></geometry></collision></link>)";
  std::string text = R"(<robot name="r"><link name="a">)" + link +
                     R"(<mesh filename="tray.obj"/></geometry></collision></link>)";
  for (const char* name : {"b", "c", "d"}) {
    text += std::string("<link name=\"") + name + "\">" + link + ball;
  }
  for (const char* joint : {"ab", "bc", "cd"}) {
    text += std::string("<joint name=\"") + joint + "\" type=\"continuous\"><parent link=\"" +
            joint[0] + "\"/><child link=\"" + joint[1] + "\"/><origin xyz=\"0.5 0 0\"/></joint>";
  }
  folder_.write("r.urdf", text + "</robot>");
  folder_.write("r.srdf",
                R"(<robot><disable_collisions link1="a" link2="d" reason="Never"/></robot>)");
  folder_.write("tray.obj",
                "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0 0.5 0\nv 0 0 0.3\nv 1 0 0.3\nv 1 0.5 0.3\n"
                "v 0 0.5 0.3\nf 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const CommandResult result = folder_.run(
      "inspect {}/r.urdf --base floating --srdf {}/r.srdf --hull-vertices 6 --meshes hull --json "
      "{}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* words : {"SRDF: Never", "overlapping in the default pose", "concave",
                            "3 of links joined by a joint"}) {
    EXPECT_NE(result.output.find(words), std::string::npos) << words;
  }
  const nlohmann::json report = folder_.json("r.json");
  EXPECT_EQ(report["joined_pairs"], 3);
  EXPECT_EQ(report["excluded_pairs"],
            nlohmann::json::parse(R"([{"a": "a/0", "b": "d/0", "reason": "SRDF: Never"}])"));
  // Pairs a - c and b - d, 1 m apart; the sixth pair is the one that the SRDF disables.
  EXPECT_EQ(report["overlapping_pairs"].size(), 2u);
  EXPECT_EQ(report["enabled_pairs"], 0);
  const nlohmann::json mesh = report["geometries"][0];
  EXPECT_EQ(mesh["vertices"], 6);
  EXPECT_EQ(mesh["concave"], true);
  EXPECT_NEAR(mesh["hull_standoff_m"], 0.25, 0.03);
  EXPECT_GT(mesh["hull_deviation_m"], 0.0);
  folder_.refuse("inspect {}/r.urdf --hull-vertices 3", "--hull-vertices");
  folder_.refuse("inspect {}/r.urdf --srdf {}/none.srdf", "none.srdf");
  folder_.refuse("inspect data/scenes/cube_drop.yaml --hull-vertices 8", "scene file");
}

TEST_F(Command, ClosuresAreListedHeldAndInverted) {
  const nlohmann::json listed = folder_.report("inspect data/scenes/closures.yaml")["closures"];
  ASSERT_EQ(listed.size(), 4u);
  EXPECT_EQ(listed[3]["type"], "weld");
  EXPECT_EQ(listed[3]["link_b"], "right/body");
  EXPECT_NEAR(listed[0]["length_m"], std::sqrt(1.09), 1e-12);
  for (const auto& closure : listed) EXPECT_NEAR(closure["open_m"], 0.0, 1e-12);
  EXPECT_EQ(folder_.json("r.json")["excluded_pairs"].size(), 2u);  // beam - load and left - right
  folder_.succeed("simulate data/scenes/closures.yaml --output {}/t.csv");
  const nlohmann::json inverse = folder_.report("inverse data/scenes/closures.yaml {}/t.csv");
  // No force is applied, so any recovered force is error.
  EXPECT_LT(inverse["unactuated_force_max"], 1e-8 * inverse["force_scale_max"].get<double>());
}

}  // namespace
}  // namespace counterpoint::command_test
