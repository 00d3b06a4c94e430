// Forces of the last step as the start of the next one: right, quick, and never decisive.
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
  ASSERT_EQ(sim.state().memory.size(), 4u);  // a corner each
  Vector3 sum = Vector3::Zero();
  for (const RememberedForce& r : sim.state().memory) {
    EXPECT_EQ(r.kind, RememberedForce::Kind::kContact);
    sum += r.force;
  }
  // The equation of motion, to the solver's tolerance; of a contact's body B, which is the ground
  // or the box.
  EXPECT_NEAR(std::abs(sum.z()), 3.0 * 9.81, 1e-9 * 30.0);
  EXPECT_NEAR(sum.head<2>().norm(), 0.0, 1e-9 * 30.0);
}

TEST(ContactMemory, AFlightRemembersNothing) {
  Simulator sim(test::free_ball({}));
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_TRUE(sim.state().memory.empty());
}

/// Newton steps of a run; with `cold`, every step is done once more without memory.
struct Counted {
  long warm = 0, cold = 0;
  double difference = 0.0;  ///< [m/s, rad/s] of the velocities of the two
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
  // Four feet, each a point: friction forces are unique there, and so is the motion, to the
  // solver's 1e-12 of momentum over the compliance of 1e-6.
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
