// Threads that share a step (Workspace::set_threads) change no bit of it.
#include <gtest/gtest.h>

#include <string>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"

namespace counterpoint::threads_test {
namespace {

Scene scene_named(const std::string& name) {
  return load_scene(test::source_dir() + "/data/scenes/" + name + ".yaml");
}

/// Steps two simulators of the scene, one on a single thread, side by side.
void expect_same_steps(const Scene& scene, int threads, int steps) {
  Simulator one(scene), many(scene);
  many.set_threads(threads);
  for (int k = 0; k < steps; ++k) {
    const StepReport a = one.step(), b = many.step();
    ASSERT_EQ(a.status, b.status) << k;
    ASSERT_EQ(a.newton_iterations, b.newton_iterations) << k;
    ASSERT_EQ(a.residual, b.residual) << k;
    ASSERT_EQ(a.softening, b.softening) << k;
    ASSERT_EQ(state_hash(one.state()), state_hash(many.state())) << k;
  }
  EXPECT_EQ(one.state().q, many.state().q);
  EXPECT_EQ(one.state().v, many.state().v);
}

TEST(Threads, ChangeNoBitOfHumanoids) {
  const Scene scene = scene_named("piles/humanoids_100");
  for (const int threads : {2, 5}) expect_same_steps(scene, threads, 120);
}

TEST(Threads, ChangeNoBitOfPiles) {
  Scene scene = scene_named("piles/pile_64");
  expect_same_steps(scene, 3, 250);
  scene.options.step_budget = 2;
  expect_same_steps(scene, 2, 250);
}

TEST(Threads, ChangeNoBitOfTheMidpointRule) {
  Scene scene = scene_named("grid_5");
  scene.options.integrator = Integrator::kImplicitMidpoint;
  expect_same_steps(scene, 4, 150);
}

TEST(Threads, ChangeNoBitOfOneTree) { expect_same_steps(scene_named("arm7"), 2, 100); }

TEST(Threads, ReturnToOne) {
  Simulator one(scene_named("grid_5")), other(scene_named("grid_5"));
  other.set_threads(2);
  other.step();
  other.set_threads(1);
  one.step();
  for (int k = 0; k < 100; ++k) {
    one.step();
    other.step();
  }
  EXPECT_EQ(one.state().v, other.state().v);
}

TEST(Threads, AreAtLeastOne) {
  Simulator sim(scene_named("arm7"));
  EXPECT_THROW(sim.set_threads(0), InputError);
  EXPECT_THROW(sim.set_threads(-2), InputError);
}

}  // namespace
}  // namespace counterpoint::threads_test
