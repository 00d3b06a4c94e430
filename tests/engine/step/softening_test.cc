// Steps that cannot be solved with their own laws are solved with softer ones, reported, and
// inverted exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::softening_test {
namespace {

/// Rounding of the inverse: that of the velocity, 1.1e-16 |v|, over mu^2 eps alpha h, relative to
/// the weight: 1.1e-7 at 5 m/s, mu 0.5, eps 1e-6, 2 ms (contact/README.md, What compliance costs).
constexpr double kRecovered = 1.1e-7;

/// Two heaps of colliding boxes, ten metres apart: two islands, of which one lands first.
Scene two_heaps() {
  const test::TempFolder folder;
  std::ostringstream text;
  text << "time_step: 0.002\nground: {friction: 0.5}\nmodels:\n";
  for (const int x : {0, 10})
    for (const int layer : {0, 1, 2})
      text << "  - {name: b" << x << "_" << layer
           << ", box: [0.2, 0.2, 0.2], mass: 1, friction: 0.5, "
           << "position: [" << x << ", 0, " << 0.2 + 0.36 * layer + 0.05 * x
           << "], rpy: [0.3, 0.4, 0.1], "
           << "velocity: {linear: [0, 0.5, -3], angular: [3, 1, 2]}}\n";
  return load_scene(folder.write("heaps.yaml", text.str()));
}

struct Outcome {
  int softened = 0, of_one_island = 0, of_all = 0;
  double error = 0.0;          ///< error of the inverse over the largest force of the step
  double error_unknown = 0.0;  ///< the same for an inverse without the softening
};

Outcome step_and_invert(const Scene& scene, const contact::Settings& settings, int steps) {
  Simulator sim(scene);
  sim.settings() = settings;
  Outcome out;
  for (int k = 0; k < steps; ++k) {
    const State before = sim.state();
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << k << " " << contact::status_name(report.status);
    const auto error = [&](const Softening& softening) {
      sim.input().softening = softening;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      sim.input().softening = {};
      // In flight only traces of smoothing act; the weight is the scale then.
      return inverse.applied_force.cwiseAbs().maxCoeff() / std::max(inverse.force_scale, 9.8);
    };
    out.error = std::max(out.error, error(report.softening));
    if (!report.softening.any()) continue;
    EXPECT_EQ(report.status, contact::Status::kSoftened);
    EXPECT_GT(std::abs(report.softening.factor), 1.0);
    ++out.softened;
    ++(report.softening.tree < 0 ? out.of_all : out.of_one_island);
    out.error_unknown = std::max(out.error_unknown, error({}));
  }
  return out;
}

TEST(Softening, IsNotNeededHere) {
  const Outcome out = step_and_invert(two_heaps(), {}, 300);
  EXPECT_EQ(out.softened, 0);
  EXPECT_LT(out.error, kRecovered);
}

TEST(Softening, NeverStopsAndTheInverseStaysExact) {
  contact::Settings hasty;
  hasty.soften_after = 1;
  const Outcome out = step_and_invert(two_heaps(), hasty, 300);
  EXPECT_GT(out.of_one_island, 10);
  EXPECT_GT(out.of_all, 10);
  EXPECT_LT(out.error, kRecovered);
  // The recorded softening makes the inverse exact.
  EXPECT_GT(out.error_unknown, 1e-3);
}

// Where islands fail one after the other, all end with the reported factor.
TEST(Softening, IslandsThatFailInTurnAreInvertedExactly) {
  contact::Settings hasty;
  hasty.soften_after = 1;
  for (const char* name : {"pile_16_masses", "chain_into_pile"}) {
    Scene scene = load_scene(test::source_dir() + "/data/scenes/piles/" + name + ".yaml");
    scene.options.time_step = 0.01;
    const Outcome out = step_and_invert(scene, hasty, 100);
    EXPECT_GT(out.of_all, 50) << name;
    EXPECT_LT(out.error, kRecovered) << name;
  }
}

// A crane whose motors, within their effort limits, press its tip on the ground. Effort limits are
// rows of the problem, but softening must leave motor forces as they are.
TEST(Softening, MotorsStayAsTheyAre) {
  const test::TempFolder folder;
  folder.write("crane.urdf", R"(<robot name="crane"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
  <inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.1 0.1"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="5000" velocity="10"/></joint>
<joint name="elbow" type="revolute"><parent link="arm"/><child link="tip"/><origin xyz="0.6 0 0"/>
  <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5000" velocity="10"/></joint></robot>)");
  const Scene scene = load_scene(folder.write("crane.yaml", R"(
ground: {friction: 0.5}
models:
  - {urdf: crane.urdf, name: crane, position: [0, 0, 0.3], dynamics: {
     shoulder: {servo: {stiffness: 2000, damping: 20, position: 0.9}},
     elbow: {servo: {stiffness: 500, damping: 5, position: -0.9}}}}
)"));
  contact::Settings hasty;
  hasty.soften_after = 1;
  const Outcome out = step_and_invert(scene, hasty, 300);
  EXPECT_GT(out.softened, 2);
  EXPECT_LT(out.error, kRecovered);
}

TEST(Softening, IsAnErrorWhereItIsNotAllowed) {
  Simulator sim(two_heaps());
  sim.settings().soften_after = 0;
  sim.settings().max_iterations = 1;
  StepReport report;
  for (int k = 0; k < 300 && report.succeeded(); ++k) report = sim.step();
  EXPECT_EQ(report.status, contact::Status::kMaxIterations);
  EXPECT_FALSE(report.softening.any());
}

TEST(Softening, AStepGivenASofteningIsTheOneThatReportedIt) {
  Simulator sim(two_heaps());
  sim.settings().soften_after = 1;
  Workspace workspace(sim.model());
  contact::Settings patient;
  int repeated = 0;
  for (int k = 0; k < 200; ++k) {
    const State before = sim.state();
    const StepReport report = sim.step();
    if (!report.softening.any()) continue;
    Input input = sim.input();
    input.softening = report.softening;
    State next;
    const StepReport again =
        step_forward(sim.model(), sim.options(), patient, before, input, workspace, next);
    EXPECT_EQ(again.softening, report.softening);
    // Both are within the solver's tolerance of the one solution of laws this soft.
    EXPECT_LT((next.v - sim.state().v).cwiseAbs().maxCoeff(), 1e-9) << k;
    ++repeated;
  }
  EXPECT_GT(repeated, 10);
}

}  // namespace
}  // namespace counterpoint::softening_test
