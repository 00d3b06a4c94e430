// Class Dynamics: its functions verify each other on random trees with every joint type.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::dynamics_class_test {
namespace {

/// Two algorithms, about 100 operations deep, on well-conditioned random trees: round-off only.
constexpr double kRoundoff = 1e-12;
/// Products of M and its inverse, with condition numbers up to about 1e3.
constexpr double kInverseRoundoff = 1e-9;
/// Central differences with step 1e-5 on smooth functions: truncation error of order step^2, and
/// round-off over the step.
constexpr double kStep = 1e-5;
constexpr double kDifference = 1e-7;

test::RandomModelOptions options(int seed) {
  test::RandomModelOptions o = test::varied_options(seed);
  o.fixed_share = 0.2;  // links merged by fixed joints have frames too
  o.armature = seed % 4 >= 2;
  return o;
}

class DynamicsOfRandomTrees : public ::testing::TestWithParam<int> {
 protected:
  DynamicsOfRandomTrees()
      : random(5000 + GetParam()),
        model(test::make_random_model(GetParam(), options(GetParam()))),
        dynamics(model),
        q(test::random_configuration(model, random.bits())),
        v(test::random_vector(model.nv(), random.bits())),
        a(test::random_vector(model.nv(), random.bits())) {
    dynamics.set_state(q, v);
  }

  VectorX inverse_dynamics(const VectorX& acceleration) {
    VectorX tau(model.nv());
    dynamics.inverse_dynamics(acceleration, tau);
    return tau;
  }
  VectorX forward_dynamics(const VectorX& tau) {
    VectorX out(model.nv());
    EXPECT_TRUE(dynamics.forward_dynamics(tau, model.armature(), out));
    return out;
  }
  /// Sets the state reached after `time` [s] along a velocity, with another velocity.
  void move(const VectorX& along, double time, const VectorX& velocity) {
    VectorX moved(model.nq());
    integrate_configuration(model, q, along, time, moved);
    dynamics.set_state(moved, velocity);
  }
  /// Central difference of f along a direction of q, while v changes by change_of_v.
  template <class Function>
  VectorX difference(const VectorX& along, const VectorX& change_of_v, Function f) {
    move(along, kStep, v + kStep * change_of_v);
    const VectorX after = f();
    move(along, -kStep, v - kStep * change_of_v);
    const VectorX before = f();
    dynamics.set_state(q, v);
    return (after - before) / (2.0 * kStep);
  }
  static double error(const MatrixX& x, const MatrixX& expected) {
    return (x - expected).norm() / (1.0 + expected.norm());
  }

  test::Random random;
  Model model;
  Dynamics dynamics;
  VectorX q, v, a;
};

TEST_P(DynamicsOfRandomTrees, ForwardUndoesInverse) {
  const VectorX tau = inverse_dynamics(a) + model.armature().cwiseProduct(a);
  EXPECT_LT(error(forward_dynamics(tau), a), kInverseRoundoff);
}

TEST_P(DynamicsOfRandomTrees, InverseIsAffineInAccelerationAndInertia) {
  MatrixX M(model.nv(), model.nv()), Y;
  dynamics.mass_matrix(M);
  const VectorX tau = inverse_dynamics(a);
  EXPECT_LT(error(M * a + inverse_dynamics(VectorX::Zero(model.nv())), tau), kRoundoff);
  EXPECT_LT(error(M, M.transpose()), kRoundoff);
  dynamics.inertia_regressor(a, Y);
  EXPECT_LT(error(Y * inertial_parameters(model), tau), kRoundoff);
  const VectorX rotors = model.armature().cwiseProduct(v);
  EXPECT_NEAR(dynamics.kinetic_energy(), 0.5 * v.dot(M * v + rotors),
              kRoundoff * (1.0 + dynamics.kinetic_energy()));
}

TEST_P(DynamicsOfRandomTrees, JacobiansGiveVelocities) {
  MatrixX J;
  for (std::size_t i = 0; i < model.frames().size(); ++i) {
    const int index = static_cast<int>(i);
    const FrameMotion motion = dynamics.frame(index);
    dynamics.frame_jacobian(index, J);
    const VectorX of_v = J * v;
    EXPECT_LT(error(of_v.head<3>(), motion.angular_velocity), kRoundoff) << model.frames()[i].name;
    EXPECT_LT(error(of_v.tail<3>(), motion.velocity), kRoundoff) << model.frames()[i].name;
    EXPECT_EQ(dynamics.frame(model.frames()[i].name).velocity, motion.velocity);
    EXPECT_EQ(dynamics.frame_pose(index).translation, motion.X_WF.translation);
  }
}

TEST_P(DynamicsOfRandomTrees, MomentumIsMassTimesVelocityOfTheCentre) {
  if (model.num_joints() == 0) {  // all links are fixed to the world
    EXPECT_TRUE(std::isnan(dynamics.center_of_mass().x()));
    return;
  }
  const VectorX velocity =
      difference(v, VectorX::Zero(model.nv()), [&] { return VectorX(dynamics.center_of_mass()); });
  EXPECT_LT(error(dynamics.momentum().force, dynamics.total_mass() * velocity), kDifference);
}

TEST_P(DynamicsOfRandomTrees, EnergyChangesByThePowerOfForces) {
  const VectorX tau = test::random_vector(model.nv(), random.bits());
  const VectorX acceleration = forward_dynamics(tau);
  const VectorX power = difference(v, acceleration, [&] {
    return VectorX::Constant(1, dynamics.kinetic_energy() + dynamics.potential_energy());
  });
  EXPECT_NEAR(power[0], tau.dot(v),
              10.0 * kDifference * (1.0 + dynamics.kinetic_energy() + tau.norm() * v.norm()));
}

TEST_P(DynamicsOfRandomTrees, DerivativesAreThoseOfDifferences) {
  const VectorX tau = inverse_dynamics(a) + model.armature().cwiseProduct(a);
  RneaDerivatives inverse;
  AbaDerivatives forward;
  dynamics.inverse_dynamics_derivatives(a, inverse);
  ASSERT_TRUE(dynamics.forward_dynamics_derivatives(tau, model.armature(), forward));
  const VectorX zero = VectorX::Zero(model.nv());
  MatrixX of_q(model.nv(), model.nv()), of_v = of_q, of_tau_q = of_q, of_tau_v = of_q;
  for (int k = 0; k < model.nv(); ++k) {
    const VectorX unit = VectorX::Unit(model.nv(), k);
    of_q.col(k) = difference(unit, zero, [&] { return inverse_dynamics(a); });
    of_v.col(k) = difference(zero, unit, [&] { return inverse_dynamics(a); });
    of_tau_q.col(k) = difference(unit, zero, [&] { return forward_dynamics(tau); });
    of_tau_v.col(k) = difference(zero, unit, [&] { return forward_dynamics(tau); });
  }
  EXPECT_LT(error(inverse.dq, of_q), kDifference);
  EXPECT_LT(error(inverse.dv, of_v), kDifference);
  EXPECT_LT(error(forward.dq, of_tau_q), 10.0 * kDifference);
  EXPECT_LT(error(forward.dv, of_tau_v), 10.0 * kDifference);
  MatrixX M = inverse.da;
  M.diagonal() += model.armature();
  EXPECT_LT(error(forward.dtau * M, MatrixX::Identity(model.nv(), model.nv())), kInverseRoundoff);
}

TEST_P(DynamicsOfRandomTrees, NothingIsAllocatedTheSecondTime) {
  if (!test::counts_allocations()) GTEST_SKIP() << "the sanitizer owns malloc";
  MatrixX M(model.nv(), model.nv()), Y, J;
  VectorX out(model.nv());
  RneaDerivatives inverse;
  AbaDerivatives forward;
  const VectorX tau = VectorX::Zero(model.nv());
  const auto all = [&] {
    dynamics.set_state(q, v);
    dynamics.frame_jacobian(0, J);
    dynamics.inverse_dynamics(a, out);
    dynamics.forward_dynamics(tau, model.armature(), out);
    dynamics.mass_matrix(M);
    dynamics.inverse_dynamics_derivatives(a, inverse);
    dynamics.forward_dynamics_derivatives(tau, model.armature(), forward);
    dynamics.inertia_regressor(a, Y);
    return dynamics.kinetic_energy() + dynamics.potential_energy() + dynamics.momentum().force.x();
  };
  const double first = all();
  const std::size_t before = test::allocation_count();
  const double second = all();
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(first, second);
}
INSTANTIATE_TEST_SUITE_P(Trees, DynamicsOfRandomTrees, ::testing::Range(0, 20));

TEST(Dynamics, RefusesStatesOfOtherSizes) {
  const Model model = test::make_random_model(3);
  Dynamics dynamics(model);
  EXPECT_THROW(dynamics.set_configuration(VectorX::Zero(model.nq() + 1)), InputError);
  EXPECT_THROW(dynamics.set_state(model.default_q(), VectorX::Zero(model.nv() + 1)), InputError);
}

}  // namespace
}  // namespace counterpoint::dynamics_class_test
