// Contacts of a step: those that may close within it, judged from (q, w).
#include "counterpoint/engine/constraints/constraints.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/estimate/contact_effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "support/small_scenes.h"

namespace counterpoint::constraints_test {
namespace {

TEST(RestingReach, IsWhatTheAccelerationClosesWithinMarginAndSmoothing) {
  ContactOptions options;
  options.reach_acceleration = 500.0;
  options.margin = 0.01;
  options.smoothing = 1e-13;
  EXPECT_EQ(resting_reach(options, 2e-3), 500.0 * 2e-3 * 2e-3);
  EXPECT_EQ(resting_reach(options, 1e-2), 0.01);  // the margin
  EXPECT_EQ(resting_reach(options, 1e-4), 500.0 * 1e-4 * 1e-4);
  EXPECT_DOUBLE_EQ(resting_reach(options, 1e-6), 1e-7);  // 1e6 smoothing lengths
  options.smoothing = 1e-3;
  EXPECT_EQ(resting_reach(options, 2e-3), 0.01);
}

/// Number of candidates: contacts with rows, parked ones, and those of far pairs
/// (parked_contacts.h).
size_t contacts_at(double height, double v_z, double acceleration) {
  Scene scene = test::box_on_plane({.height = height});
  scene.options.time_step = 2e-3;
  scene.options.contact.reach_acceleration = acceleration;
  scene.v[2] = v_z;
  Data data(scene.model);
  ConstraintFinder finder(scene.model, compute_inverse_weights(scene.model, data));
  ConstraintSet found;
  const EffectSet effects =
      active_effects(called_for(scene.model, finder.collider()), scene.options.effects);
  estimation::find_all_constraints({scene.model, scene.options, effects, scene.q, scene.v}, finder,
                                   data, found);
  EXPECT_EQ(found.contacts.size(), found.pairs.size());
  return found.contacts.size();
}

// Contacts up to h^2 a = 2 mm at 2 ms are found (h^2 g is 0.04 mm); a speed v adds 2 h |v|.
TEST(ConstraintFinder, HasTheContactsThatMayCloseWithinTheStep) {
  EXPECT_EQ(contacts_at(1.9e-3, 0.0, 500.0), 4);
  EXPECT_EQ(contacts_at(2.1e-3, 0.0, 500.0), 0);
  EXPECT_EQ(contacts_at(5.9e-3, -1.0, 500.0), 4);
  EXPECT_EQ(contacts_at(6.1e-3, -1.0, 500.0), 0);
  EXPECT_EQ(contacts_at(9.9e-3, 0.0, 1e9), 4);  // the margin of 10 mm
  EXPECT_EQ(contacts_at(10.1e-3, 0.0, 1e9), 0);
}

// A force closes a gap for which the step had no contact: the overlap is the distance that the
// force makes in one step, the inverse is as exact as ever, and the next step has the contact.
TEST(ConstraintFinder, AContactMissedIsMetOneStepLater) {
  constexpr double kGap = 2.5e-3, kForce = 1000.0, h = 2e-3;
  Scene scene = test::box_on_plane({.mass = 1.0, .height = kGap});
  scene.options.time_step = h;
  Simulator sim(std::move(scene));
  const State before = sim.state();
  sim.input().applied_force[2] = -kForce;
  StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.contacts, 0);
  const State after = sim.state();
  // q+ = q + h w+, w+ = -h (F / m + g): rounding of a metre.
  EXPECT_NEAR(after.q[2] - before.q[2], -h * h * (kForce + 9.81), 1e-15);
  // Rounding of w+ over h: a few times 1e-16 * 2 m/s * 1 kg / 2 ms.
  EXPECT_NEAR(sim.inverse(before.q, before.v, after.v).applied_force[2], -kForce, 1e-11);
  sim.input().applied_force[2] = 0.0;
  report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.contacts, 4);
  EXPECT_NEAR(report.max_penetration, h * h * (kForce + 9.81) - kGap, 1e-15);
  // It leaves no faster than the speed that recovery of an overlap may leave.
  EXPECT_LE(sim.state().v[2], 2e-3);
  EXPECT_GE(sim.state().v[2], 0.0);
}

}  // namespace
}  // namespace counterpoint::constraints_test
