// The hand of a live session: where it brings a body, and that no mass or step makes it unstable.
#include "live/inputs/hand.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/simulator.h"
#include "live/history.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::live::hand_test {
namespace {

void pull(Simulator& simulator, Hand& hand) {
  hand.update(simulator.state(), simulator.options().time_step);
  ExternalWrench wrench;
  wrench.body = hand.body();
  wrench.frame = hand.frame();
  wrench.wrench = hand.wrench();
  simulator.input().wrenches = {wrench};
  ASSERT_TRUE(simulator.step().succeeded());
}

TEST(Hand, HoldsABodyBelowItsTargetByGravityOverTheSpring) {
  // At rest k (target - x) / (1 + a h (d + h k)) = m g, with k = 100 m / s^2, d = 20 m / s, h = 2
  // ms and the mobility across the radius of a ball, a = 1 / m + r^2 / (0.4 m r^2) = 3.5 / m.
  const double sag_expected =
      kStandardGravity / 100.0 * (1.0 + 3.5 * 0.002 * (20.0 + 0.002 * 100.0));
  for (const double mass : {1e-3, 1.0, 1e4}) {
    Simulator simulator(
        counterpoint::test::free_ball({.mass = mass, .gravity = {0, 0, -kStandardGravity}}));
    Hand hand(simulator.model());
    hand.drag(1, Vector3(0, 0, 0.1), Vector3(0.2, 0, 1.0));
    for (int k = 0; k < 5000; ++k) pull(simulator, hand);
    const Vector3 sag = Vector3(0.2, 0, 1.0) - hand.point();
    // After 10 s the swing below the held point has decayed to less than this.
    EXPECT_NEAR(sag.z(), sag_expected, 1e-6) << mass;
    EXPECT_NEAR(hand.force().z(), mass * kStandardGravity, 1e-4 * mass) << mass;
  }
}

TEST(Hand, IsStableForLightLinksAndLongSteps) {
  for (const double h : {1e-4, 0.002, 0.02}) {
    Scene scene = load_scene(counterpoint::test::source_dir() + "/data/scenes/humanoid_drop.yaml");
    scene.options.time_step = h;
    Simulator simulator(std::move(scene));
    Hand hand(simulator.model());
    const int body = simulator.model().num_bodies() - 1;
    double mass = 0.0;
    for (const Body& b : simulator.model().bodies()) mass += b.inertia.mass;
    for (int k = 0; simulator.state().time < 2.0; ++k) {
      const double side = (k / 50) % 2 ? 0.5 : -0.5;
      hand.drag(body, Vector3(0.05, 0.02, 0), Vector3(side, 0, 1.5));
      pull(simulator, hand);
      EXPECT_LE(hand.force().norm(), 20.0 * mass * kStandardGravity * (1.0 + 1e-12));
    }
    // A hand that feeds energy into an oscillation would reach hundreds of metres per second.
    EXPECT_LT(simulator.state().v.head<3>().norm(), 20.0) << h;
  }
}

TEST(History, RewindsToTheLastStateAtOrBeforeATime) {
  History history;
  State state;
  state.q = state.v = VectorX::Zero(1);
  for (int k = 0; k < 5000; ++k) {
    state.time = 0.01 * k;
    history.add(state);
  }
  EXPECT_NEAR(history.start(), 0.01 * (5000 - 3600), 1e-9);
  EXPECT_NEAR(history.rewind(20.005)->time, 20.0, 1e-9);
  EXPECT_NEAR(history.end(), 20.0, 1e-9);
  EXPECT_NEAR(history.rewind(-1.0)->time, history.start(), 1e-9);
}

TEST(History, IsBoundedInMemory) {
  History history;
  State state;
  state.q = state.v = VectorX::Zero(100'000);
  for (int k = 0; k < 200; ++k) {
    state.time = k;
    history.add(state);
  }
  EXPECT_LE((history.end() - history.start() + 1.0) * static_cast<double>(bytes_of(state)),
            static_cast<double>(History::kMostBytes));
}

}  // namespace
}  // namespace counterpoint::live::hand_test
