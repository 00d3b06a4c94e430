// Velocity-dependent forces at mid-step: a bilinear form, and no drift of energy.
#include "counterpoint/engine/forces/mid_velocity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics/rnea.h"
#include "support/linkages.h"
#include "support/random_model.h"

namespace counterpoint::mid_velocity_test {
namespace {

using test::simulate;

/// Velocity-dependent forces as rnea returns them, -n(q, w) [N, N m].
VectorX plain_force(const Model& model, const VectorX& q, const VectorX& w) {
  Data data(model);
  compute_poses(model, q, data);
  compute_velocities(model, w, data);
  VectorX tau(model.nv());
  rnea(model, VectorX::Zero(model.nv()), Vector3::Zero(), data, tau);
  return tau;
}

/// The bilinear form -B(w, other) of these forces [N, N m], by the mean forces of MidVelocity.
VectorX bilinear_force(const Model& model, const VectorX& q, const VectorX& w,
                       const VectorX& other) {
  Data data(model);
  compute_poses(model, q, data);
  compute_velocities(model, w, data);
  compute_inertias(model, data);
  MidVelocity mid_velocity(model);
  for (const Tree& tree : model.trees()) mid_velocity.add_force(model, w, other, tree, data);
  VectorX tau(model.nv());
  rnea(model, VectorX::Zero(model.nv()), Vector3::Zero(), data, tau);
  return tau;
}

TEST(MidVelocity, IsTheBilinearFormOfTheForcesAtOneVelocity) {
  for (int seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    const Base base = seed % 2 ? Base::kFixed : Base::kFloating;
    ModelBuilder builder(Vector3::Zero());
    builder.add_robot(test::make_random_robot(seed, {.links = 7, .base = base}), base, Pose(), "");
    const Model model = builder.build();
    const VectorX q = model.default_q();
    const VectorX w = test::random_vector(model.nv(), seed, 3.0);
    const VectorX other = test::random_vector(model.nv(), 100 + seed, 3.0);
    // Rounding of recursions through seven links.
    const double rounding = 1e-13 * (1.0 + plain_force(model, q, w + other).norm());
    EXPECT_LT((bilinear_force(model, q, w, w) - plain_force(model, q, w)).norm(), rounding);
    const VectorX polar = 0.5 * (plain_force(model, q, w + other) - plain_force(model, q, w) -
                                 plain_force(model, q, other));
    EXPECT_LT((bilinear_force(model, q, w, other) - polar).norm(), rounding);
  }
}

/// Three rods on ball joints, released level and turning about the vertical.
Model make_ball_chain() {
  RobotSpec robot = test::base_only("chain", "link0");
  for (int i = 0; i < 3; ++i) {
    test::add_rod(robot, "link" + std::to_string(i + 1), "link" + std::to_string(i),
                  "joint" + std::to_string(i + 1), Vector3(i > 0 ? 0.3 : 0.0, 0, 0),
                  0.3 * Vector3::UnitX(), Vector3::UnitY());
    robot.joints.back().type = JointType::kSpherical;
  }
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  return builder.build();
}

/// Mean total energy over the last fifth of 20 s less that over the first [J].
double gain(Model model, double time_step, Integrator integrator, const VectorX& v) {
  Simulator sim = simulate(std::move(model), time_step);
  sim.options().integrator = integrator;
  State start = sim.state();
  start.v = v;
  sim.set_state(start);
  const int fifth = static_cast<int>(std::lround(4.0 / time_step));
  double first = 0.0, last = 0.0;
  for (int i = 0; i < 5 * fifth; ++i) {
    EXPECT_TRUE(sim.step().succeeded()) << i;
    if (i < fifth) first += test::energy(sim).total();
    if (i >= 4 * fifth) last += test::energy(sim).total();
  }
  return (last - first) / fifth;
}

// With velocity-dependent forces at the start of the step these trees gained 2 to 7 % of m g 1 m.
TEST(MidVelocity, TreesKeepTheirEnergyForLong) {
  const Model model = make_ball_chain();
  VectorX v = VectorX::Zero(model.nv());
  v[2] = 2.0;
  // 1 % of m g 1 m = 8.8 J: means of chaotic motions differ by h times their power.
  EXPECT_LT(std::abs(gain(make_ball_chain(), 0.001, Integrator::kSemiImplicitEuler, v)), 0.09);
}

TEST(MidVelocity, LinkagesKeepTheirEnergyForLong) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    const VectorX v = VectorX::Zero(3);
    // 1e-3 of m g 1 m = 17 J.
    EXPECT_LT(std::abs(gain(test::make_four_bar({}), 0.001, integrator, v)), 0.017);
  }
}

/// Five rods in a plane, hung by both ends: a chaotic motion, taut with a jerk now and then.
Model make_hung_chain() {
  RobotSpec robot = test::base_only("chain", "link0");
  for (int i = 0; i < 5; ++i)
    test::add_rod(robot, "link" + std::to_string(i + 1), "link" + std::to_string(i),
                  "joint" + std::to_string(i + 1), Vector3(i > 0 ? 0.4 : 0.0, 0, 0),
                  0.4 * Vector3::UnitX(), Vector3::UnitY());
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  const double angles[] = {-0.5, 0.3, 0.6, 0.6, 0.6};
  for (int i = 0; i < 5; ++i)
    builder.set_default_position("joint" + std::to_string(i + 1), VectorX::Constant(1, angles[i]));
  ClosureSpec closure;
  closure.type = ClosureType::kBall;
  closure.link_a = "link5";
  closure.link_b = "world";
  closure.anchor_a = Vector3(0.4, 0, 0);
  builder.add_closure(closure);
  return builder.build();
}

TEST(MidVelocity, AHungChainKeepsItsEnergyAndItsEnd) {
  Simulator sim = simulate(make_hung_chain(), 0.001);
  const test::Swing run = test::swing(sim, 20.0);
  // Up to 60 rad/s. With the curvature at w alone such a chain opened by 50 um.
  EXPECT_LT(run.open, 5e-6);
  // 5e-3 of m g 1 m = 20 J.
  EXPECT_LT(
      std::abs(gain(make_hung_chain(), 0.001, Integrator::kSemiImplicitEuler, VectorX::Zero(5))),
      0.1);
}

}  // namespace
}  // namespace counterpoint::mid_velocity_test
