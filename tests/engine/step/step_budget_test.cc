// Steps with a budget of Newton steps: SimulationOptions::step_budget.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::step_budget_test {
namespace {

/// Rounding of the inverse, relative to the weight (softening_test.cc).
constexpr double kRecovered = 1.1e-7;

Scene pile(const std::string& name) {
  return load_scene(test::source_dir() + "/data/scenes/piles/" + name + ".yaml");
}

double energy(const Simulator& sim, Dynamics& dynamics) {
  dynamics.set_state(sim.state().q, sim.state().v);
  return dynamics.kinetic_energy() + dynamics.potential_energy();
}

class StepBudget : public testing::TestWithParam<const char*> {};

// However small the budget, no step fails and the energy never exceeds that of the start. Overlap
// corrections displace bodies upwards; their work stays below what friction and impacts take.
TEST_P(StepBudget, LosesEnergyAtAnyBudget) {
  for (const int budget : {1, 16}) {
    Scene scene = pile(GetParam());
    scene.options.step_budget = budget;
    Simulator sim(std::move(scene));
    Dynamics dynamics(sim.model());
    const double start = energy(sim, dynamics);
    int unfinished = 0;
    for (int k = 0; k < 400; ++k) {
      const StepReport report = sim.step();
      ASSERT_TRUE(report.succeeded()) << k << " " << contact::status_name(report.status);
      ASSERT_EQ(report.status == contact::Status::kUnfinished, report.softening.unfinished());
      ASSERT_FALSE(report.softening.softens());
      ASSERT_LE(energy(sim, dynamics), start);
      unfinished += report.softening.unfinished();
    }
    EXPECT_TRUE(budget > 1 || unfinished > 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, StepBudget,
                         testing::Values("dominoes_50", "brick_wall", "pile_64_masses"));

// The inverse of a finished step recovers the applied force, here none. That of an unfinished one
// counts the contacts of the unfinished island as applied: the sum of both is right.
TEST(UnfinishedStep, HasAnInverseThatCountsItsContactsAsApplied) {
  Scene scene = pile("pile_16");
  scene.options.step_budget = 1;
  Simulator sim(std::move(scene));
  int unfinished = 0, finished = 0;
  for (int k = 0; k < 300; ++k) {
    const State before = sim.state();
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded());
    sim.input().softening = report.softening;
    const Inverse told = sim.inverse(before.q, before.v, sim.state().v);
    sim.input().softening = {};
    ASSERT_FALSE(told.fault.any());
    if (!report.softening.unfinished()) {
      ++finished;
      EXPECT_LT(told.applied_force.lpNorm<Eigen::Infinity>(),
                kRecovered * std::max(told.force_scale, 9.8));
      continue;
    }
    ++unfinished;
    const Inverse untold = sim.inverse(before.q, before.v, sim.state().v);
    const VectorX sum = untold.applied_force + untold.contact_force;
    EXPECT_LT((told.applied_force + told.contact_force - sum).lpNorm<Eigen::Infinity>(),
              1e-12 * untold.force_scale);  // rounding of a difference
    if (report.softening.tree < 0) {
      EXPECT_LT(told.contact_force.lpNorm<Eigen::Infinity>(), 1e-100);
    }
  }
  EXPECT_GT(unfinished, 20);
  EXPECT_GT(finished, 20);
}

TEST(StepBudgetOption, ChangesNoStepThatNeedsLess) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/box_stack.yaml");
  Simulator free(scene);
  scene.options.step_budget = 200;
  Simulator bounded(scene);
  for (int k = 0; k < 200; ++k) {
    free.step();
    EXPECT_FALSE(bounded.step().softening.any());
  }
  EXPECT_EQ(free.state().q, bounded.state().q);
  EXPECT_EQ(free.state().v, bounded.state().v);
}

TEST(StepBudgetOption, IsReadFromScenes) {
  const test::TempFolder folder;
  const auto read = [&](const std::string& value) {
    return load_scene(
               folder.write("s.yaml", "step_budget: " + value +
                                          "\nmodels:\n  - {name: b, sphere: 0.1, mass: 1}\n"))
        .options.step_budget;
  };
  EXPECT_EQ(read("16"), 16);
  EXPECT_EQ(read("none"), 0);
  for (const char* bad : {"0", "-1", "1.5", "some", "[]", "1e20"})
    EXPECT_THROW(read(bad), InputError) << bad;
}

TEST(StepBudgetOption, ExcludesStrictStepsAndNegativeNumbers) {
  Simulator sim(pile("pile_16"));
  sim.options().step_budget = 16;
  sim.settings().soften_after = 0;
  EXPECT_THROW(sim.step(), InputError);
  sim.options().step_budget = -1;
  sim.settings().soften_after = 160;
  EXPECT_THROW(sim.step(), InputError);
}

TEST(UnfinishedStep, IsMarkedInTrajectories) {
  const test::TempFolder folder;
  Scene scene = pile("pile_16");
  scene.options.step_budget = 1;
  Simulator sim(std::move(scene));
  const std::filesystem::path file = folder.path() / "pile.csv";
  std::vector<Softening> softening;
  {
    TrajectoryWriter out(file, sim.model());
    for (int k = 0; k < 150; ++k) {
      const State before = sim.state();
      softening.push_back(sim.step().softening);
      out.write_step(before, sim.input(), sim.options().time_step, softening.back());
    }
    out.write_end(sim.state());
  }
  EXPECT_TRUE(std::any_of(softening.begin(), softening.end(),
                          [](const Softening& s) { return s.unfinished(); }));
  EXPECT_EQ(read_trajectory(file, sim.model()).softening, softening);
}

}  // namespace
}  // namespace counterpoint::step_budget_test
