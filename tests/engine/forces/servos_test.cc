// Implicit servos with and without an effort limit, against the discrete scheme by hand.
#include "counterpoint/engine/forces/servos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/robot_files.h"
#include "support/allocation_guard.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::servos_test {
namespace {

constexpr double kRoundoff = 1e-12;

/// One coordinate with a servo, by hand: velocity after the step, and motor force [N].
struct ByHand {
  double mass, h, kp, kd, limit;
  double q, w = 0.0, force = 0.0;

  void step(double target, double target_velocity, double applied) {
    const double pull = kp * (target - q) + kd * target_velocity + applied;
    // m (w+ - w) = h (pull - (kd + h kp) w+), with the force clamped to the motor's limit.
    double next = (mass * w + h * pull) / (mass + h * kd + h * h * kp);
    force = std::clamp(pull - (kd + h * kp) * next, -limit, limit);
    if (std::abs(force) == limit) next = w + h * force / mass;
    w = next;
    q += h * w;
  }
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Servos, FollowMovingTargetsAsByHandWithAndWithoutLimit) {
  const double mass = 2.0, kp = 300.0, kd = 20.0;
  for (const double limit : {kInfinity, 1e3, 8.0, 2.0, 0.0}) {
    for (const double h : {1e-3, 1e-2}) {
      Scene scene =
          test::slider({.mass = mass, .servo = {kp, kd, 0.2, 0.0}, .effort_limit = limit});
      scene.options.time_step = h;
      Simulator sim(std::move(scene));
      ByHand hand{mass, h, kp, kd, limit, 0.0};
      int at_limit = 0;
      for (int i = 0; i < 400; ++i) {
        double target = 0.2, target_velocity = 0.0;  // the model's own target
        const double applied = i < 200 ? 0.0 : 3.0 * std::sin(0.05 * i);
        if (i >= 100) {
          target = 0.5 * std::sin(2.0 * h * i);
          target_velocity = std::cos(2.0 * h * i);
          sim.input().servo_position = VectorX::Constant(1, target);
          sim.input().servo_velocity = VectorX::Constant(1, target_velocity);
        }
        sim.input().applied_force[0] = applied;
        const State before = sim.state();
        ASSERT_TRUE(sim.step().succeeded());
        hand.step(target, target_velocity, applied);
        ASSERT_NEAR(sim.state().v[0], hand.w, kRoundoff) << limit << " step " << i;
        ASSERT_NEAR(sim.state().q[0], hand.q, kRoundoff) << limit << " step " << i;
        // The inverse returns the motor's total force, at the limit and within it.
        const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
        const double total = inverse.applied_force[0] + inverse.servo_force[0];
        ASSERT_NEAR(total, hand.force, 1e-9) << limit << " step " << i;  // rounding of w / h
        if (std::abs(hand.force) < limit)
          ASSERT_NEAR(inverse.applied_force[0], applied, 1e-9) << limit << " step " << i;
        else
          ++at_limit;
      }
      if (limit <= 8.0)
        EXPECT_GT(at_limit, 10) << limit;
      else
        EXPECT_EQ(at_limit, 0) << limit;
    }
  }
}

TEST(Servos, AtTheLimitTheyAccelerateByLimitOverMassUntilTheTargetIsNear) {
  const double mass = 4.0, limit = 10.0;
  Simulator sim(
      test::slider({.mass = mass, .servo = {1000.0, 400.0, 5.0, 0.0}, .effort_limit = limit}));
  const double h = sim.options().time_step;
  for (int i = 1; i <= 300; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_NEAR(sim.state().v[0], i * h * limit / mass, kRoundoff);
  }
}

TEST(Servos, TheRecoveredForceAtTheLimitGivesTheSameMotion) {
  const double limit = 5.0;
  Simulator sim(test::slider({.servo = {1e4, 10.0, 1.0, 0.0}, .effort_limit = limit}));
  for (const double applied : {0.0, 100.0, -100.0, 3.0}) {
    sim.input().applied_force[0] = applied;
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const State after = sim.state();
    const Inverse& inverse = sim.inverse(before.q, before.v, after.v);
    sim.input().applied_force = inverse.applied_force;
    sim.set_state(before);
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.state().v[0], after.v[0], kRoundoff);
  }
}

TEST(Servos, EnergyOfServoAndLoadNeverRisesTowardsAFixedTarget) {
  const double mass = 1.0;
  for (const double kd : {0.0, 1.0, 1e3}) {
    for (const double limit : {kInfinity, 4.0}) {
      const double kp = 2e3;
      Scene scene =
          test::slider({.mass = mass, .servo = {kp, kd, 0.1, 0.0}, .effort_limit = limit});
      scene.options.time_step = 0.01;
      scene.v[0] = 0.3;
      Simulator sim(std::move(scene));
      // m w^2 / 2 plus the potential whose slope is the clamped servo force.
      const auto energy = [&] {
        const double e = std::abs(sim.state().q[0] - 0.1);
        const double knee = limit / kp;
        const double stored = e < knee ? 0.5 * kp * e * e : limit * (e - 0.5 * knee);
        return 0.5 * mass * sim.state().v[0] * sim.state().v[0] + stored;
      };
      double last = energy();
      for (int i = 0; i < 300; ++i) {
        ASSERT_TRUE(sim.step().succeeded());
        if (kd == 0.0 || limit == kInfinity) {
          ASSERT_LE(energy(), last * (1.0 + kRoundoff)) << kd << " step " << i;
        }
        last = energy();
      }
    }
  }
}

/// The bundled arm with stiff servos.
Scene stiff_arm(double h) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/arm7_servo.yaml");
  scene.options.time_step = h;
  return scene;
}

/// The same arm with other servo gains.
Scene arm_with_gains(double stiffness, double damping, double h) {
  ModelBuilder builder;
  RobotSpec arm = load_urdf(test::source_dir() + "/data/robots/arm7.urdf");
  for (JointSpec& joint : arm.joints) joint.servo = {stiffness, damping, {}, 0.0};
  builder.add_robot(arm, Base::kFixed, Pose());
  builder.set_default_position("shoulder_pitch", VectorX::Constant(1, 0.7));
  builder.set_default_position("elbow", VectorX::Constant(1, 0.9));
  builder.set_default_position("wrist_pitch", VectorX::Constant(1, 0.5));
  Scene scene{"arm", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(scene.model.nv());
  scene.options.time_step = h;
  return scene;
}

TEST(Servos, HoldAnArmAtStiffnessOneMillionAndTenMilliseconds) {
  // kd / kp = 0.1 s is overdamped for all inertias of the arm: every joint creeps from one side
  // towards the deflection force / kp under its load.
  Simulator sim(arm_with_gains(1e6, 1e5, 0.01));
  const VectorX start = sim.state().q;
  double last = 0.0;
  std::vector<VectorX> sag;
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(sim.step().succeeded()) << i;
    sag.push_back(sim.state().q - start);
    ASSERT_GE(sag.back().norm(), last * (1.0 - 1e-9)) << i;  // monotone
    last = sag.back().norm();
    ASSERT_LT(sim.state().v.norm(), 1e-2);
  }
  const VectorX end = sag.back();
  // Less than the arm's largest gravity torque, about 60 N m, over kp.
  EXPECT_LT(end.cwiseAbs().maxCoeff(), 6e-5);
  EXPECT_GT(end.cwiseAbs().maxCoeff(), 1e-6);
  for (const VectorX& s : sag) {
    // No overshoot: never beyond the final deflection, except in the last bits.
    ASSERT_LE((s.cwiseAbs() - end.cwiseAbs()).maxCoeff(), 1e-9);
  }
}

TEST(Servos, PushedAwayTheStiffArmComesBackWithoutOscillation) {
  Scene scene = arm_with_gains(1e6, 1e5, 0.01);
  const VectorX target = scene.q;
  scene.q += VectorX::Constant(7, 0.02);
  Simulator sim(std::move(scene));
  double last = 1.0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(sim.step().succeeded()) << i;
    const VectorX error = sim.state().q - target;
    ASSERT_LT(error.norm(), last * (1.0 + 1e-9) + 1e-6) << i;
    // The overshoot stays below the deflection under load.
    ASSERT_GT(error.minCoeff(), -1e-4) << i;
    last = error.norm();
  }
  EXPECT_LT(last, 1e-4);
}

TEST(Servos, BundledSceneIsHeldWithinItsEffortLimits) {
  Simulator sim(stiff_arm(0.01));
  const VectorX start = sim.state().q;
  for (int i = 0; i < 300; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-9 * inverse.force_scale) << i;
    for (size_t k = 0; k < sim.model().servos().size(); ++k) {
      const double limit = sim.model().joint(sim.model().servos()[k].joint).effort_limit;
      ASSERT_LE(std::abs(inverse.servo_force[k]), limit) << k;
    }
  }
  EXPECT_LT((sim.state().q - start).cwiseAbs().maxCoeff(), 0.1);
}

TEST(Servos, DoNotAllocateAfterWarmUp) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim(stiff_arm(0.002));
  sim.input().servo_position = VectorX::Constant(7, 0.3);
  sim.input().servo_velocity = VectorX::Zero(7);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
  const VectorX q = sim.state().q, v = sim.state().v;
  ASSERT_TRUE(sim.step().succeeded());
  sim.inverse(q, v, sim.state().v);
  const std::size_t before = test::allocation_count();
  for (int i = 0; i < 100; ++i) sim.step();
  sim.inverse(q, v, sim.state().v);
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

TEST(Servos, SwitchedOffTheyLeaveTheAppliedForceToTheEffortLimit) {
  Scene scene = test::slider({.mass = 2.0, .servo = {1e3, 10.0, 1.0, 0.0}, .effort_limit = 3.0});
  scene.options.effects.set(Effect::kServos, false);
  Simulator sim(std::move(scene));
  sim.input().applied_force[0] = 5.0;
  const StepReport report = sim.step();
  EXPECT_EQ(report.constraint_rows, 0);
  EXPECT_NEAR(sim.state().v[0], sim.options().time_step * 3.0 / 2.0, kRoundoff);
  EXPECT_EQ(sim.effect_counts()[Effect::kServos], 0);
}

}  // namespace
}  // namespace counterpoint::servos_test
