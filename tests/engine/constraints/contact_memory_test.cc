// Forces of the last step warm-start the next one: correct, fast, and without effect on the result.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::contact_memory_test {
namespace {

Scene bundled(const std::string& name) {
  return load_scene(test::source_dir() + "/data/scenes/" + name + ".yaml");
}

TEST(ContactMemory, HoldsTheForcesOfTheStep) {
  Simulator sim(test::box_on_plane({.mass = 3.0}));
  for (int k = 0; k < 50; ++k) ASSERT_TRUE(sim.step().succeeded());
  ASSERT_EQ(sim.state().memory.size(), 4u);  // one per corner
  Vector3 sum = Vector3::Zero();
  for (const RememberedForce& r : sim.state().memory) {
    EXPECT_EQ(r.kind, RememberedForce::Kind::kContact);
    sum += r.force;
  }
  // Equilibrium, to the solver's tolerance. Forces act on a contact's body B, the ground or the
  // box.
  EXPECT_NEAR(std::abs(sum.z()), 3.0 * 9.81, 1e-9 * 30.0);
  EXPECT_NEAR(sum.head<2>().norm(), 0.0, 1e-9 * 30.0);
}

TEST(ContactMemory, AFlightRemembersNothing) {
  Simulator sim(test::free_ball({}));
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_TRUE(sim.state().memory.empty());
}

/// Newton steps of a run with memory (warm), and of the same steps repeated without it (cold).
struct Counted {
  long warm = 0, cold = 0;
  double difference = 0.0;  ///< velocity difference [m/s, rad/s]
};
Counted count(const std::string& scene, int steps) {
  Simulator sim(bundled(scene)), other(bundled(scene));
  Counted out;
  for (int k = 0; k < steps; ++k) {
    State forgetful = sim.state();
    forgetful.memory.clear();
    other.set_state(forgetful);
    out.warm += sim.step().newton_iterations;
    out.cold += other.step().newton_iterations;
    out.difference =
        std::max(out.difference, (sim.state().v - other.state().v).cwiseAbs().maxCoeff());
  }
  return out;
}

TEST(ContactMemory, SavesNewtonStepsAndLeavesTheMotion) {
  const Counted out = count("quadruped_drop", 600);
  // Four point feet: friction forces are unique, and so is the motion, up to the solver's 1e-12 of
  // momentum over the compliance of 1e-6.
  EXPECT_LT(out.difference, 1e-6);
  RecordProperty("warm", static_cast<int>(out.warm));
  RecordProperty("cold", static_cast<int>(out.cold));
  EXPECT_LT(out.warm, out.cold);
}

TEST(ContactMemory, SavesAFifthOnTheFallingHumanoid) {
  const Counted out = count("humanoid_drop", 400);
  RecordProperty("warm", static_cast<int>(out.warm));
  RecordProperty("cold", static_cast<int>(out.cold));
  EXPECT_LT(5 * out.warm, 4 * out.cold);
}

}  // namespace
}  // namespace counterpoint::contact_memory_test
