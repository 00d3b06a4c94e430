// Inverse dynamics through files: `inverse` recovers the forces that `simulate` applied.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "apps/command.h"
#include "counterpoint/engine/trajectory.h"
#include "support/paths.h"

namespace counterpoint::inverse_test {
namespace {

using test::CommandFolder;
using test::CommandResult;

/// A scene driven at random for long enough to cover falls, impacts and joint limits.
struct Case {
  const char* name;
  const char* file;     ///< "@": in the folder of shared data
  const char* options;  ///< command line options
  double duration;      ///< [s]
  double inputs = 2.0;  ///< value of --random-inputs
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Inverse : public testing::TestWithParam<std::tuple<Case, double>> {};

/// Required bound on |recovered - applied force| / largest force at work.
constexpr double kRelativeError = 1e-8;

TEST_P(Inverse, RecoversRandomAppliedForces) {
  const auto& [scenario, time_step] = GetParam();
  const CommandFolder folder(std::string("inverse_") + scenario.name + std::to_string(time_step));
  std::string scene = scenario.file;
  if (scene[0] == '@') {
    scene = test::shared_data() + "/robots/" + scene.substr(1);
    if (!std::filesystem::exists(scene)) {
      GTEST_SKIP() << "no " << scene << "; set COUNTERPOINT_SHARED_DATA";
    }
  }
  scene += std::string(" ") + scenario.options;
  folder.succeed("simulate " + scene + " --timestep " + std::to_string(time_step) + " --duration " +
                 std::to_string(scenario.duration) + " --random-inputs " +
                 std::to_string(scenario.inputs) + " --seed 3 --output {}/t.csv --json {}/f.json");
  const nlohmann::json report =
      folder.report("inverse " + scene + " {}/t.csv --output {}/u.csv --contacts {}/c.csv");
  EXPECT_EQ(report["steps"], folder.json("f.json")["steps"]);
  EXPECT_LT(report["applied_force_relative_error_max"], kRelativeError);
  EXPECT_GT(report["applied_force_max"], 0.0);
  // A floating base is not actuated, so any force found there is error.
  EXPECT_LT(report["unactuated_force_max"],
            kRelativeError * report["force_scale_max"].get<double>());
  RecordProperty("relative_error", report["applied_force_relative_error_max"].dump());
}

const Case kCases[] = {
    {"humanoid", "data/scenes/humanoid_drop.yaml", "", 1.0},
    {"quadruped", "data/scenes/quadruped_drop.yaml", "", 0.5},
    {"arm7", "data/scenes/arm7.yaml", "", 0.8},
    {"solo12", "@solo12/solo_description/robots/solo12.urdf", "--base floating --ground", 1.0,
     1.0},  // 2.0 turns its shins by up to 5 rad per 10 ms step; round-off then gives 2e-8
    {"panda", "@panda_primitives/panda_description/urdf/panda_collision.urdf", "--base fixed",
     1.0},  // on a ground at z = 0 its first link would start 9 cm deep
    {"husky", "@husky/data/husky/husky.urdf", "--base floating --ground", 1.0},
};

INSTANTIATE_TEST_SUITE_P(
    Robots, Inverse, testing::Combine(testing::ValuesIn(kCases), testing::Values(1e-4, 1e-3, 1e-2)),
    [](const auto& chosen) {
      const double h = std::get<1>(chosen.param);
      return std::string(std::get<0>(chosen.param).name) + (h < 5e-4   ? "_100us"
                                                            : h < 5e-3 ? "_1ms"
                                                                       : "_10ms");
    });

TEST(InverseFiles, RecoveredForcesDriveTheSameMotion) {
  const CommandFolder folder("inverse_roundtrip");
  const std::string scene = "data/scenes/arm7.yaml";
  folder.succeed("simulate " + scene +
                 " --duration 0.2 --random-inputs 0.5 --output {}/a.csv "
                 "--json {}/a.json");
  folder.succeed("inverse " + scene + " {}/a.csv --output {}/u.csv");
  folder.succeed("simulate " + scene +
                 " --duration 0.2 --inputs {}/u.csv --output {}/b.csv "
                 "--json {}/b.json");
  // The energy at the end depends on the whole motion; forces are recovered to round-off.
  EXPECT_NEAR(folder.json("a.json")["energy_end_J"], folder.json("b.json")["energy_end_J"], 1e-8);
}

TEST(InverseFiles, ContactsCarryTheWeightOfACubeAtRest) {
  const CommandFolder folder("inverse_contacts");
  folder.write("rest.yaml",
               "name: rest\ntime_step: 0.002\nduration: 1\nground: {friction: 0.5}\n"
               "models:\n  - urdf: " +
                   test::source_dir() +
                   "/data/robots/cube.urdf\n    base: floating\n    position: [0, 0, 0.1]\n");
  folder.succeed("simulate {}/rest.yaml --output {}/t.csv");
  folder.succeed("inverse {}/rest.yaml {}/t.csv --contacts {}/c.csv");
  // The last four rows are the corners in the last step. The last three columns are the slip; the
  // one before is the force along z on geometry b, the ground.
  const std::string csv = folder.read("c.csv");
  double weight = 0.0;
  size_t end = csv.size() - 1;
  for (int corner = 0; corner < 4; ++corner) {
    for (int slip = 0; slip < 3; ++slip) end = csv.rfind(',', end - 1);
    const size_t begin = csv.rfind(',', end - 1) + 1;
    weight -= std::stod(csv.substr(begin, end - begin));
    end = csv.rfind('\n', begin);
  }
  // At rest to the solver's relative tolerance of 1e-10, after 500 steps of settling.
  EXPECT_NEAR(weight, 9.80665, 1e-6);
}

TEST(InverseFiles, WhereNothingMovesNothingIsFound) {
  const CommandFolder folder("inverse_still");
  folder.write("still.urdf", R"(<robot name="still"><link name="base"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>)");
  for (const std::string integrator : {"semi_implicit_euler", "implicit_midpoint"}) {
    const std::string scene = "{}/still.urdf --ground --integrator " + integrator;
    folder.succeed("simulate " + scene + " --duration 0.05 --output {}/t.csv");
    folder.succeed("inverse " + scene + " {}/t.csv --json {}/i.json");
    EXPECT_EQ(folder.json("i.json")["steps"], 25);
    EXPECT_EQ(folder.json("i.json")["force_scale_max"], 0.0);
  }
}

TEST(InverseFiles, ServoTargetsAndWrenchesAreKnownFromTheTrajectory) {
  const CommandFolder folder("inverse_known");
  // Only some columns are given: the other servos keep the scene's targets, and elbow_link is
  // pushed. Targets move too little to saturate the motors; at the effort limit the motion does not
  // determine u.
  folder.write("in.csv",
               "time,elbow.u,elbow.target,wrist_pitch.target_velocity,elbow_link.fx,elbow_link.tz\n"
               "0,1,0.9,0,0,0\n0.02,2,0.92,0.1,15,-2\n0.05,-1,0.88,0,0,3\n");
  const std::string scene = "data/scenes/arm7_servo.yaml";
  folder.succeed("simulate " + scene + " --duration 0.1 --inputs {}/in.csv --output {}/t.csv");
  const nlohmann::json report = folder.report("inverse " + scene + " {}/t.csv --output {}/u.csv");
  EXPECT_EQ(report["applied_force_max"], 2.0);
  EXPECT_LT(report["applied_force_relative_error_max"], kRelativeError);
  folder.write("bad.csv", "time,elbow.targt\n0,1\n");
  folder.refuse("simulate " + scene + " --inputs {}/bad.csv", "elbow.targt");
}

/// A gripper holds the box of 1 kg, lets go of it, and drops the one of 4 kg; the trajectory has
/// its switches and states, so that the inverse finds that no force but those of the servos acted.
TEST(InverseFiles, ActuatorsAreKnownFromTheTrajectoryAndListTheirForces) {
  const CommandFolder folder("inverse_actuators");
  folder.succeed(
      "simulate data/scenes/quadrotor.yaml --duration 0.1 --random-inputs 0.01 --output {}/t.csv");
  const nlohmann::json report =
      folder.report("inverse data/scenes/quadrotor.yaml {}/t.csv --output {}/u.csv");
  EXPECT_LT(report["applied_force_relative_error_max"], kRelativeError);
  const Table forces(folder.path("u.csv"));
  // The torque of the motor at hovering speed is the drag of its propeller: 1.6e-7 w^2.
  EXPECT_NEAR(forces.value(0, forces.column("motor1.force")), 0.0211896, 1e-5);
  folder.succeed(
      "simulate data/scenes/quadrotor.yaml --duration 0.05 --inputs {}/u.csv --output "
      "{}/again.csv");
}

TEST(InverseFiles, SwitchedClosuresAreKnownFromTheTrajectory) {
  const CommandFolder folder("inverse_switched");
  const std::string scene = "data/scenes/suction_gripper.yaml";
  folder.succeed("simulate " + scene +
                 " --inputs data/scenes/suction_gripper.csv --output {}/t.csv");
  const nlohmann::json report = folder.report("inverse " + scene + " {}/t.csv --output {}/u.csv");
  EXPECT_EQ(report["applied_force_max"], 0.0);
  EXPECT_LT(report["applied_force_relative_error_max"], kRelativeError);
  const Scene loaded = load_scene(test::source_dir() + "/" + scene);
  const Trajectory t = read_trajectory(folder.path("t.csv"), loaded.model);
  const int end = t.num_rows() - 1;
  const auto at = [](double time) { return static_cast<int>(std::lround(time / 0.002)); };
  const auto state = [&](const char* name, int row) {
    const std::vector<std::string> names = coordinate_names(loaded.model).z;
    const auto i = std::find(names.begin(), names.end(), name) - names.begin();
    return t.z(i, row);
  };
  EXPECT_EQ(state("grip light.attached", at(0.1)), 0.0);
  EXPECT_EQ(state("grip light.attached", at(1.5)), 1.0);
  EXPECT_EQ(state("grip light.attached", end), 0.0);
  EXPECT_EQ(state("grip heavy.attached", end), -1.0);
  // Places of the light and of the heavy box on the ground, and the light one in the air.
  const int light = loaded.model.body(3).q_index, heavy = loaded.model.body(4).q_index;
  EXPECT_GT(t.q(light + 2, at(1.2)), 0.2);
  EXPECT_NEAR(t.q(light, end), 0.5, 0.02);
  EXPECT_NEAR(t.q(light + 2, end), 0.05, 1e-3);
  EXPECT_NEAR(t.q(heavy, end), 0.1, 0.02);
  EXPECT_NEAR(t.q(heavy + 2, end), 0.05, 1e-3);
}

/// 64 bodies that start half inside each other, driven at random: every step is softened.
constexpr const char* kSoftened =
    "data/scenes/piles/pile_64_overlap.yaml --duration 0.02 --random-wrenches 0.5";

TEST(InverseFiles, SoftenedStepsAreInvertedByTheirRecord) {
  const CommandFolder folder("inverse_softened");
  folder.succeed(std::string("simulate ") + kSoftened + " --output {}/t.csv --json {}/f.json");
  ASSERT_GT(folder.json("f.json")["softened_steps"], 0) << "needs a scene that is harder to solve";
  const std::string scene = "data/scenes/piles/pile_64_overlap.yaml";
  folder.succeed("inverse " + scene + " {}/t.csv --json {}/i.json");
  const nlohmann::json report = folder.json("i.json");
  EXPECT_GT(report["applied_force_max"], 1.0);
  EXPECT_LT(report["applied_force_relative_error_max"], kRelativeError);
  // The inverse depends on the two softening columns: without them it is wrong.
  std::string csv = folder.read("t.csv"), line, without;
  std::istringstream lines(csv);
  while (std::getline(lines, line)) {
    const size_t tree = line.rfind(',', line.rfind(',') - 1), factor = line.rfind(',', tree - 1);
    without += line.substr(0, factor) + line.substr(line.rfind(',')) + "\n";
  }
  folder.write("without.csv", without);
  EXPECT_GT(
      folder.report("inverse " + scene + " {}/without.csv")["applied_force_relative_error_max"],
      1e-3);
}

TEST(InverseFiles, RolloutsKnowOfSoftenedSteps) {
  const CommandFolder folder("rollout_softened");
  const nlohmann::json report =
      folder.report(std::string("rollout ") + kSoftened + " --count 2 --invert");
  EXPECT_GT(report["softened_steps"], 0);
  EXPECT_LT(report["force_error_max"], kRelativeError * report["force_scale_max"].get<double>());
}

TEST(InverseFiles, RefusesATrajectoryOfAnotherScene) {
  const CommandFolder folder("inverse_other");
  folder.succeed("simulate data/scenes/cube_drop.yaml --duration 0.01 --output {}/t.csv");
  folder.refuse("inverse data/scenes/arm7.yaml {}/t.csv", "cube.x");
}

/// Rewrites a trajectory with `digits` digits, every `every`-th row, and without the named columns.
std::string spoilt(const std::string& text, int digits, int every,
                   const std::vector<std::string>& without) {
  std::istringstream lines(text);
  std::string line, out;
  std::vector<bool> kept;
  for (int row = -1; std::getline(lines, line); ++row) {
    if (row > 0 && row % every != 0) continue;
    std::istringstream cells(line);
    std::string cell, spoilt;
    for (size_t i = 0; std::getline(cells, cell, ','); ++i) {
      if (row < 0) kept.push_back(std::find(without.begin(), without.end(), cell) == without.end());
      if (!kept[i]) continue;
      if (row >= 0 && !cell.empty() && cell.size() < 19 + 6 &&
          cell.find_first_not_of("0123456789") != std::string::npos)
        cell = fmt::format("{:.{}g}", std::stod(cell), digits);
      spoilt += (spoilt.empty() ? "" : ",") + cell;
    }
    out += spoilt + "\n";
  }
  return out;
}

// The ground carries a box at rest. Rounded velocities do not determine the contact forces, so the
// weight must not be reported as an applied force without a warning.
TEST(InverseFiles, RoundedAndThinnedRowsAreSentToTheCommandThatFits) {
  const CommandFolder folder("inverse_rounded");
  folder.write("s.yaml",
               "ground: {}\nmodels: [{name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [0.3, "
               "0.2, 0.1]}]\n");
  folder.succeed("simulate {}/s.yaml --duration 0.5 --output {}/m.csv");
  EXPECT_EQ(folder.run("inverse {}/s.yaml {}/m.csv").errors, "")
      << "of its own motion nothing is doubted";
  const std::string motion = folder.read("m.csv");
  const std::vector<std::string> marks = {"state_hash", "softening", "softened_tree"}, nothing;
  std::vector<std::string> bare = marks;
  bare.insert(bare.end(), {"time_step", "box/body.fx", "box/body.fy", "box/body.fz", "box/body.tx",
                           "box/body.ty", "box/body.tz"});
  int doubted = 0;
  for (const int digits : {4, 6, 9}) {
    for (const std::vector<std::string>& without : {nothing, marks, bare}) {
      folder.write("r.csv", spoilt(motion, digits, 1, without));
      const CommandResult result = folder.run("inverse {}/s.yaml {}/r.csv --json {}/r.json");
      ASSERT_EQ(result.exit_code, 0) << result.errors;
      const double found = folder.json("r.json")["unactuated_force_max"];
      const bool named = result.errors.find("compare --mode inverse") != std::string::npos;
      EXPECT_TRUE(named || found < 1e-6 * 2 * 9.80665)
          << digits << ": " << found << " N without a word";
      doubted += named;
    }
  }
  EXPECT_GT(doubted, 3);
  folder.write("thin.csv", spoilt(motion, 17, 5, nothing));
  folder.refuse("inverse {}/s.yaml {}/thin.csv", "compare --mode inverse");
}

}  // namespace
}  // namespace counterpoint::inverse_test
