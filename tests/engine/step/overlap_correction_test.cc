// Overlaps are recovered by displacement: bodies separate and keep no speed from it
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
#include "support/temp_folder.h"

namespace counterpoint::test::overlap_correction_test {
namespace {

constexpr double kDeep = 0.01;  // [m]

/// Speed that a body may keep [m/s], plus a tenth for the compliance of the constraints.
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
  EXPECT_GT(fastest, 0.5 * kKept);             // the last part is recovered by velocity
  EXPECT_LE(fastest, kKept);
}

// Each step displaces the body by -h b, with the bias b = max(-beta d/h, -max_recovery_speed).
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
    // The constraint yields by r f, r = 1e-6 alpha.
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
    // It rises at every step, and no higher than its rest height; smoothing lets it hover by 1e-13
    // m.
    EXPECT_GE(sim.state().q[2], before - 1e-12);
    EXPECT_LE(sim.state().q[2], rest + 1e-9);
    before = sim.state().q[2];
  }
  EXPECT_NEAR(sim.state().q[2], rest, 1e-6);  // 0.8^n of the overlap remains
}

TEST(OverlapCorrection, IsNoBusinessOfTheInverse) {
  Random random(7);
  Simulator sim(box_on_plane(deep_box()));
  // Torques of 5 N m throw it about at up to 16 rad/s, on edges and corners: |J| |w| is 3 m/s.
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

TEST(OverlapCorrection, LawsPushWhatIsHeldDeepLess) {
  SimulationOptions options;
  const double h = options.time_step;
  const LawOptions law = law_options(options);
  const double deep = kPushed * law.kept_recovery * h / law.stabilization;  // [m]
  EXPECT_EQ(law_bias(law, h, -deep), -law.kept_recovery);
  EXPECT_NEAR(law_bias(law, h, -2.0 * deep), -0.25 * law.kept_recovery, 1e-15);
  EXPECT_NEAR(law_bias(law, h, -100.0 * deep), -1e-4 * law.kept_recovery, 1e-15);
  const double dx = 1e-5 * deep;  // truncation error dx^2, and rounding
  for (const double share : {-1.0, 0.1, 0.5, 1.2, 1.8, 3.0}) {
    const double gap = -share * deep;
    const double change = (law_bias(law, h, gap + dx) - law_bias(law, h, gap - dx)) / (2.0 * dx);
    EXPECT_NEAR(law_bias_slope(law, h, gap), change, 1e-8 / h) << share;
  }
  options.integrator = Integrator::kImplicitMidpoint;  // no displacement
  const LawOptions all = law_options(options);
  EXPECT_EQ(law_bias(all, h, -1000.0 * deep), -all.max_recovery_speed);
}

// A bar on a revolute joint at the height of the ground, one half of it always 10 cm deep: nothing
// can lift it. Its contacts carry the load of gravity and do not push each other.
TEST(OverlapCorrection, WhatIsHeldInTheGroundTakesNoForceButItsLoad) {
  const TempFolder folder;
  folder.write("bar.urdf", R"(<robot name="bar"><link name="base"/>
<link name="bar"><inertial><mass value="1"/>
  <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.6 0.1 0.2"/></geometry></collision></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="bar"/><axis xyz="0 1 0"/></joint>
<link name="tip"><inertial><origin xyz="0.1 0 0"/><mass value="0.1"/>
  <inertia ixx="0.0001" iyy="0.0005" izz="0.0005" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.05 0.05"/></geometry></collision></link>
<joint name="wrist" type="continuous"><parent link="bar"/><child link="tip"/><origin xyz="0.3 0 0"/>
  <axis xyz="0 1 0"/></joint></robot>)");
  Simulator sim(load_scene(folder.write("bar.yaml", R"(
ground: {friction: 0.8}
models:
  - {name: bar, urdf: bar.urdf, base: fixed}
)")));
  const double weight = 1.1 * kStandardGravity;
  double pushed = 0.0, found = 0.0, scale = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded()) << i;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    found = std::max(found, inverse.applied_force.lpNorm<Eigen::Infinity>());
    scale = std::max(scale, inverse.force_scale);
    if (i < 500) continue;  // the tip has come to rest
    for (const ContactForce& contact : inverse.contacts)
      pushed = std::max(pushed, contact.force.norm());
  }
  EXPECT_LT(pushed, weight);
  EXPECT_LT(found, 1e-8 * scale);  // required accuracy of the inverse
}

// A light body leaves a heavy one at no more than the speed that any overlap may leave.
TEST(OverlapCorrection, ALightBodyInAHeavyOneKeepsNoMoreSpeedThanOthers) {
  const TempFolder folder;
  Simulator sim(load_scene(folder.write("light.yaml", R"(
gravity: [0, 0, 0]
models:
  - {name: heavy, box: [1, 1, 1], mass: 1000, position: [0, 0, 0]}
  - {name: light, box: [0.1, 0.1, 0.1], mass: 0.0001, position: [0, 0, 1.09]}
)")));
  double fastest = 0.0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(sim.step().succeeded()) << i;
    fastest = std::max(fastest, sim.state().v.norm());
  }
  EXPECT_GE(sim.state().q[9], 1.1);  // out
  EXPECT_LE(fastest, kKept);
}

// A box in a slot that is too narrow: 7 cm deep in one wall, 0.03 mm in the other. The latter would
// push it into the former for ever, with kept_recovery over compliance, 5e4 times its weight.
TEST(OverlapCorrection, WhatIsWedgedPushesByWeights) {
  const TempFolder folder;
  Simulator sim(load_scene(folder.write("slot.yaml", R"(
environment:
  - {name: left, box: [0.5, 1, 1], position: [-0.57, 0, 0]}
  - {name: right, box: [0.5, 1, 1], position: [0.59997, 0, 0]}
  - {name: floor, box: [1, 1, 0.5], position: [0, 0, -0.6]}
models:
  - {name: part, box: [0.1, 0.1, 0.1], mass: 3, position: [0, 0, 0], friction: 0.5}
)")));
  const double weight = 3.0 * kStandardGravity;
  double pushed = 0.0, energy = 0.0;
  for (int i = 0; i < 500; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded()) << i;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    for (const ContactForce& contact : inverse.contacts)
      pushed = std::max(pushed, contact.force.norm());
    energy = std::max(energy, 0.5 * 3.0 * sim.state().v.head<3>().squaredNorm());
  }
  // kKeptWeights, times 1 / max(mu, 0.1)^2 by the friction of a normal row.
  EXPECT_LT(pushed, 1.1 * kKeptWeights / 0.01 * weight);
  EXPECT_LT(energy, 3.0 * kKept * kKept);
}

// The midpoint rule derives velocities from positions: the body keeps its recovery speed, as
// documented.
TEST(OverlapCorrection, TheMidpointRuleKeepsTheSpeed) {
  BoxOnPlane floating = deep_box();
  floating.gravity.setZero();
  Scene scene = box_on_plane(floating);
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
  // Without gravity w+ = w_c, the bias of the first steps.
  EXPECT_NEAR(sim.state().v[2], ContactOptions{}.max_recovery_speed, 1e-3);
}

// Twenty-five boxes side by side, each an island.
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

// A box of 1000 kg starts 15 cm deep in one of 1 kg, flat on it: it rises and stands on it. The
// light one, without friction while it is pressed out, slides by a centimetre at most.
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
