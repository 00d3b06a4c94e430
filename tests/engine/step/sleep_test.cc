// Sleeping islands are left out of the step, which changes no bit of any motion.
#include <gtest/gtest.h>

#include <cstring>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::sleep_test {
namespace {

Scene read(const std::string& yaml, bool sleeping = true) {
  const test::TempFolder folder;
  Scene scene = load_scene(folder.write("scene.yaml", yaml));
  scene.options.effects.set(Effect::kSleeping, sleeping);
  return scene;
}

/// Columns of three boxes that come to rest, and a box that falls on one of them after about 0.9 s.
const std::string kColumns = R"(
ground: {friction: 0.6}
models:
  - {name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.101], count: 3, spacing: [0, 0, 0.201]}
  - {name: b, box: [0.1, 0.1, 0.1], mass: 1, position: [0.5, 0, 0.101], count: 3, spacing: [0, 0, 0.201]}
  - {name: c, cylinder: [0.1, 0.2], mass: 1, position: [0, 0.5, 0.101], count: 3, spacing: [0, 0, 0.201]}
)";
const std::string kLate = R"(
  - {name: late, box: [0.1, 0.1, 0.1], mass: 1, position: [0.05, 0.03, 2], velocity: {linear: [0, 0, 3]}}
)";

bool same_bits(const VectorX& a, const VectorX& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(double) * a.size()) == 0;
}
#define EXPECT_SAME_STATE(a, b, step) \
  EXPECT_TRUE(same_bits((a).q, (b).q) && same_bits((a).v, (b).v)) << "step " << (step)

int run_until_asleep(Simulator& sim, int bodies, int most) {
  for (int k = 0; k < most; ++k)
    if (sim.step().sleeping_bodies == bodies) return k;
  return most;
}

TEST(Sleep, EqualsTheRunThatNeverSleptToTheBit) {
  Simulator sleeper(read(kColumns + kLate)), waker(read(kColumns + kLate, false));
  int most = 0, woken = 0, last = 0;
  for (int k = 0; k < 3000; ++k) {
    const StepReport report = sleeper.step();
    ASSERT_TRUE(report.succeeded() && waker.step().succeeded()) << k;
    ASSERT_TRUE(same_bits(sleeper.state().q, waker.state().q)) << k;
    ASSERT_TRUE(same_bits(sleeper.state().v, waker.state().v)) << k;
    most = std::max(most, report.sleeping_bodies);
    woken += report.sleeping_bodies < last;
    last = report.sleeping_bodies;
  }
  // All three columns slept, the falling box woke the first, and all sleep in the end.
  EXPECT_EQ(most, 10);
  EXPECT_GE(woken, 1);
  EXPECT_EQ(last, 10);
}

/// Bodies at rest beside others that still fall, roll and approach them.
Scene pile(const std::string& name, bool sleeping) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/piles/" + name + ".yaml");
  scene.options.effects.set(Effect::kSleeping, sleeping);
  return scene;
}

TEST(Sleep, PilesMoveToTheBitAsIfNoneSlept) {
  for (const std::string name : {"pile_16", "pile_16_masses", "chain_into_pile"}) {
    Simulator sleeper(pile(name, true)), waker(pile(name, false));
    int most = 0;
    for (int k = 0; k < 1000; ++k) {
      most = std::max(most, sleeper.step().sleeping_bodies);
      waker.step();
      EXPECT_SAME_STATE(sleeper.state(), waker.state(), k) << name;
      if (testing::Test::HasFailure()) return;
    }
    EXPECT_GT(most, 0) << name;
  }
}

TEST(Sleep, TheInverseOfAPileFindsNothingApplied) {
  Simulator sim(pile("pile_16", true));
  const Scene scene = pile("pile_16", true);
  Workspace ws(scene.model);
  Inverse inverse;
  double largest = 0.0, scale = 0.0;
  int most = 0;
  for (int k = 0; k < 1000; ++k) {
    const State before = sim.state();
    const StepReport report = sim.step();
    ASSERT_FALSE(report.softening.any()) << k;
    most = std::max(most, report.sleeping_bodies);
    step_inverse(scene.model, scene.options, before.q, before.v, sim.state().v, ws, inverse);
    largest = std::max(largest, inverse.applied_force.cwiseAbs().maxCoeff());
    scale = std::max(scale, inverse.force_scale);
  }
  EXPECT_GT(most, 0);
  // Required accuracy of the inverse.
  EXPECT_LT(largest, 1e-8 * scale);
}

TEST(Sleep, ColumnsSleepWithinASecondAndAStepThenRunsNothing) {
  Simulator sim(read(kColumns));
  EXPECT_LT(run_until_asleep(sim, 9, 500), 500);
  const StepReport report = sim.step();
  EXPECT_EQ(report.sleeping_bodies, 9);
  EXPECT_EQ(report.contacts, 0);
  EXPECT_EQ(report.constraint_rows, 0);
  EXPECT_GT(report.max_penetration, 0.0);  // still reported
}

TEST(Sleep, BundledPilesComeToRest) {
  for (const char* name : {"cube_drop", "box_stack", "stack_5", "grid_5", "pyramid_5"}) {
    Simulator sim(load_scene(test::source_dir() + "/data/scenes/" + name + ".yaml"));
    const int bodies = sim.model().num_joints();
    EXPECT_LT(run_until_asleep(sim, bodies, 3000), 3000) << name;
  }
}

TEST(Sleep, APushWakesTheIslandPushedAndNoOther) {
  Simulator sim(read(kColumns)), never(read(kColumns, false));
  ASSERT_LT(run_until_asleep(sim, 9, 500), 500);
  while (never.state().time < sim.state().time) never.step();
  for (Simulator* s : {&sim, &never}) s->input().applied_force[0] = 0.5;  // along x, on a0
  EXPECT_EQ(sim.step().sleeping_bodies, 6);
  never.step();
  EXPECT_SAME_STATE(sim.state(), never.state(), 0);
  for (Simulator* s : {&sim, &never}) {
    s->input().applied_force[0] = 0.0;
    s->input().wrenches.push_back({4, {Vector3::Zero(), Vector3(0, 1, 0)}});  // on b0
  }
  for (int k = 0; k < 500; ++k) {
    const StepReport report = sim.step();
    EXPECT_LE(report.sleeping_bodies, 6);  // a body with a wrench on it never sleeps
    never.step();
    ASSERT_TRUE(same_bits(sim.state().v, never.state().v)) << k;
  }
}

// Near a fast body contacts are searched farther. A body in its reach has more candidates than at
// rest, so that its step differs even if nothing strikes it.
TEST(Sleep, AFastBodyThatPassesNearWakesAndLeavesTheMotionAsItIs) {
  // After a second the ball passes the cylinder 5 cm away at 60 m/s, 12 cm a step.
  const std::string scene = R"(
ground: {friction: 0.6}
models:
  - {name: lies, cylinder: [0.1, 0.4], mass: 1, position: [0, 0, 0.1001], rpy: [1.5707963, 0, 0]}
  - {name: far, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 5, 0.101]}
  - {name: fast, sphere: 0.05, mass: 1, position: [-60, 0, 5.2], velocity: {linear: [60, 0, 0]}}
)";
  Simulator sim(read(scene)), never(read(scene, false));
  for (int k = 0; k < 600; ++k) {
    const double ball = sim.state().q[14];  // x of the ball before the step [m]
    const int asleep = sim.step().sleeping_bodies;
    // Within 2 h |v| plus the radii it is in reach: then only the box at 5 m sleeps.
    if (std::abs(ball) < 0.3) {
      EXPECT_EQ(asleep, 1) << ball;
    } else if (k > 400 && ball < -1.0) {
      EXPECT_EQ(asleep, 2) << ball;
    }
    never.step();
    EXPECT_SAME_STATE(sim.state(), never.state(), k);
    if (testing::Test::HasFailure()) return;
  }
}

// Where several islands need softer laws in one step, all bodies get them, also those at rest,
// whose motion must stay the same to the bit.
TEST(Sleep, SofterLawsOfAllAreThoseOfTheSleepingToo) {
  const std::string falling = R"(
  - {name: d, box: [0.1, 0.1, 0.1], mass: 1, position: [1, 0, 2], rpy: [0.3, 0.2, 0], count: 3, spacing: [0.5, 0, 0]}
)";
  const Scene scene = read(kColumns + falling);
  Simulator sim(scene), never(read(kColumns + falling, false));
  Workspace ws(scene.model);
  Inverse inverse;
  Input known;
  int asleep = 0, of_all = 0;
  double largest = 0.0, scale = 0.0;
  for (int k = 0; k < 600; ++k) {
    // The columns come to rest by their own laws; later steps soften after two iterations.
    for (Simulator* s : {&sim, &never})
      s->settings().soften_after = k > 300 ? 2 : contact::Settings().soften_after;
    const State before = sim.state();
    const int slept = asleep;
    const StepReport report = sim.step();
    never.step();
    EXPECT_SAME_STATE(sim.state(), never.state(), k);
    if (testing::Test::HasFailure()) return;
    asleep = report.sleeping_bodies;
    if (report.softening.any() && report.softening.tree < 0) of_all += slept > 0;
    known.softening = report.softening;
    step_inverse(scene.model, scene.options, before.q, before.v, sim.state().q, sim.state().v,
                 known, ws, inverse);
    largest = std::max(largest, inverse.applied_force.lpNorm<Eigen::Infinity>());
    scale = std::max(scale, inverse.force_scale);
  }
  EXPECT_GT(of_all, 0);
  EXPECT_LT(largest, 1e-8 * scale);  // required accuracy of the inverse
}

TEST(Sleep, MovingABodyByHandWakesIt) {
  Simulator sim(read(kColumns));
  ASSERT_LT(run_until_asleep(sim, 9, 500), 500);
  State moved = sim.state();
  moved.q[2] += 0.3;  // a0, into the boxes above
  sim.set_state(moved);
  EXPECT_EQ(sim.step().sleeping_bodies, 6);
}

TEST(Sleep, ChangedOptionsWakeAll) {
  Simulator sim(read(kColumns));
  ASSERT_LT(run_until_asleep(sim, 9, 500), 500);
  sim.options().contact.compliance *= 2.0;
  EXPECT_EQ(sim.step().sleeping_bodies, 0);
}

TEST(Sleep, TheInverseSeesBodiesAtRestAndLeavesTheMotionAsItIs) {
  Simulator sim(read(kColumns)), never(read(kColumns, false));
  ASSERT_LT(run_until_asleep(sim, 9, 500), 500);
  while (never.state().time < sim.state().time) never.step();
  for (int k = 0; k < 5; ++k) {
    const State before = sim.state();
    sim.step();
    never.step();
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    // Nothing is applied, contacts carry the weight, to the engine's tolerance of 1e-9.
    EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-9 * inverse.force_scale);
    double carried = 0.0;
    for (const ContactForce& contact : inverse.contacts)
      if (sim.model().geometries()[contact.contact.geometry_a].body == 0 ||
          sim.model().geometries()[contact.contact.geometry_b].body == 0)
        carried += std::abs(contact.force.z());
    EXPECT_NEAR(carried, 9.0 * kStandardGravity, 1e-6 * 9.0 * kStandardGravity);
    EXPECT_SAME_STATE(sim.state(), never.state(), k);
  }
}

TEST(Sleep, DoesNotReachThroughOneThatIsAwake) {
  // A box on a slope within the friction cone creeps (eps g h sin) and never sleeps; the box beside
  // it on the plane does.
  Simulator sim(read(R"(
gravity: [0, 0, -9.81]
ground: {friction: 0.8}
models:
  - {name: flat, box: [0.1, 0.1, 0.1], mass: 1, position: [3, 0, 0.1]}
  - {name: creeping, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.43], rpy: [0, 0.5, 0]}
environment:
  - {name: slope, box: [1, 1, 0.1], rpy: [0, 0.5, 0], position: [0, 0, 0.2], friction: 0.8}
)"));
  StepReport report;
  for (int k = 0; k < 1500; ++k) report = sim.step();
  EXPECT_EQ(report.sleeping_bodies, 1);
}

}  // namespace
}  // namespace counterpoint::sleep_test
