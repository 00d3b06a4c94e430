// Overlaps are recovered by displacement: bodies part, and keep no speed from it
// (overlap_correction.h).
#include "counterpoint/engine/step/overlap_correction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"
#include "support/allocation_guard.h"
#include "support/linkages.h"
#include "support/paths.h"
#include "support/recover.h"
#include "support/small_scenes.h"

namespace counterpoint::test::overlap_correction_test {
namespace {

constexpr double kDeep = 0.01;  // [m]

/// The speed that may be kept [m/s], plus a tenth for the constraints' own give.
const double kKept = 1.1 * kKeptRecovery * ContactOptions{}.max_recovery_speed;

BoxOnPlane deep_box() {
  BoxOnPlane box;
  box.height = -kDeep;
  return box;
}

TEST(OverlapCorrection, AnOverlapLeavesTheSpeedThatMayBeKept) {
  BoxOnPlane floating = deep_box();
  floating.gravity.setZero();
  Simulator sim(box_on_plane(floating));
  const double start = sim.state().q[2];
  double fastest = 0.0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    fastest = std::max(fastest, sim.state().v.norm());
  }
  EXPECT_GE(sim.state().q[2], start + kDeep);  // out, in 0.4 s
  EXPECT_GT(fastest, 0.5 * kKept);             // the last part is by velocity
  EXPECT_LE(fastest, kKept);
}

// b = max(-beta d/h, -max_recovery_speed): what each step moves a body by is what it was before.
TEST(OverlapCorrection, GoesAtThePaceOfTheBias) {
  BoxOnPlane floating = deep_box();
  floating.gravity.setZero();
  Simulator sim(box_on_plane(floating));
  const double h = sim.options().time_step;
  const ContactOptions& contact = sim.options().contact;
  double depth = kDeep;
  for (int i = 0; i < 10; ++i) {
    const double before = sim.state().q[2];
    ASSERT_TRUE(sim.step().succeeded());
    const double moved = sim.state().q[2] - before;
    // The constraint gives by r f, r = 1e-6 alpha.
    EXPECT_NEAR(moved, -h * gap_bias(contact, h, -depth), 1e-5 * moved) << "step " << i;
    depth -= moved;
  }
}

TEST(OverlapCorrection, ABoxInTheGroundRisesAndNeverJumps) {
  Simulator sim(box_on_plane(deep_box()));
  const double rest = sim.state().q[2] + kDeep;
  double before = sim.state().q[2];
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    // Up at every step, and no higher than where it rests: smoothing lets it hover by 1e-13 m.
    EXPECT_GE(sim.state().q[2], before - 1e-12);
    EXPECT_LE(sim.state().q[2], rest + 1e-9);
    before = sim.state().q[2];
  }
  EXPECT_NEAR(sim.state().q[2], rest, 1e-6);  // 0.8^n of what is left
}

TEST(OverlapCorrection, IsNoBusinessOfTheInverse) {
  Random random(7);
  Simulator sim(box_on_plane(deep_box()));
  // Thrown about at up to 16 rad/s by torques of 5 N m, on edges and corners: |J| |w| is 3 m/s.
  EXPECT_LE(recover(sim, 40, 5.0, random), 2.0 * kRecovered);
}

TEST(OverlapCorrection, AJointBeyondItsLimitComesBackWithoutSwinging) {
  Pendulum beyond;
  beyond.lower = 0.1;
  beyond.upper = 1.0;
  Scene scene = pendulum(beyond);
  scene.q[0] = 0.0;  // 0.1 rad below the lower limit
  Simulator sim(std::move(scene));
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_LE(std::abs(sim.state().v[0]), kKept);
  }
  EXPECT_NEAR(sim.state().q[0], 0.1, 1e-6);  // gravity holds it at the limit
}

// The midpoint rule reads velocities off positions: it keeps what it recovers with, as documented.
TEST(OverlapCorrection, TheMidpointRuleKeepsTheSpeed) {
  BoxOnPlane floating = deep_box();
  floating.gravity.setZero();
  Scene scene = box_on_plane(floating);
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
  // Without gravity w+ = w_c, which is the bias of the first steps.
  EXPECT_NEAR(sim.state().v[2], ContactOptions{}.max_recovery_speed, 1e-3);
}

// Twenty-five boxes side by side, an island each.
TEST(OverlapCorrection, MovesTheIslandsThatOverlapAndNoOthers) {
  constexpr int kPushed = 12, kCoordinates = 7;
  constexpr double kRest = 0.1;  // [m], half a box
  Scene scene = load_scene(source_dir() + "/data/scenes/grid_5.yaml");
  for (int i = 2; i < scene.q.size(); i += kCoordinates) scene.q[i] = kRest;
  Scene pushed = scene;
  pushed.q[kPushed * kCoordinates + 2] -= kDeep;
  Simulator plain(scene), sim(pushed);
  for (int i = 0; i < 20; ++i) {
    const double height = sim.state().q[kPushed * kCoordinates + 2];
    ASSERT_TRUE(plain.step().succeeded());
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_GT(sim.state().q[kPushed * kCoordinates + 2], height);
    for (int k = 0; k < sim.state().q.size(); ++k) {
      if (k / kCoordinates == kPushed) continue;
      EXPECT_EQ(sim.state().q[k], plain.state().q[k]) << "coordinate " << k << ", step " << i;
    }
  }
}

// A box of 1000 kg that starts 15 cm deep in one of 1 kg, flat on it: it rises and stands on it.
// The light one, without friction while it is pressed out, slides by a centimetre at most.
TEST(OverlapCorrection, AHeavyBoxRisesOutOfALightOne) {
  constexpr double kHalf = 0.1;
  for (const double aside : {0.0, 0.02, 0.04}) {
    ModelBuilder builder;
    Material rough;
    rough.friction = 0.5;
    builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), rough);
    const Shape box{ShapeType::kBox, Vector3(kHalf, kHalf, kHalf), nullptr};
    builder.add_robot(object_of("light", box, 1.0, rough), Base::kFloating,
                      {Matrix3::Identity(), Vector3(0, 0, kHalf)}, "light/");
    builder.add_robot(object_of("heavy", box, 1000.0, rough), Base::kFloating,
                      {Matrix3::Identity(), Vector3(aside, 0.01, 3.0 * kHalf - 0.15)}, "heavy/");
    Simulator sim(scene_of(builder.build()));
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.state().q[9], 3.0 * kHalf, 1e-4) << aside;
    EXPECT_NEAR(sim.state().q[2], kHalf, 1e-6) << aside;
    EXPECT_LE(sim.state().q.head<2>().norm(), 0.011) << aside;
    EXPECT_NEAR(sim.state().q[7], aside, 1e-4);
  }
}

TEST(OverlapCorrection, DoesNotAllocateOnceSeen) {
  if (!counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim(box_on_plane(deep_box()));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(sim.step().succeeded());
  const std::size_t before = allocation_count();
  for (int i = 0; i < 5; ++i) sim.step();
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace counterpoint::test::overlap_correction_test
