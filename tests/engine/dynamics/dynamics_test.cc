// RNEA, CRBA and ABA against each other and against first principles, on random trees with every
// joint type.
#include "counterpoint/engine/dynamics.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "support/random_model.h"

namespace counterpoint::dynamics_test {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Two algorithms, about 100 operations deep, on well-conditioned random trees: round-off only.
constexpr double kRoundoff = 1e-12;
/// Central differences with step 1e-5 on smooth functions of unit scale: error of order step^2.
constexpr double kDifferenceStep = 1e-5;
constexpr double kDifference = 2e-8;

test::RandomModelOptions options(int seed) {
  test::RandomModelOptions o = test::varied_options(seed);
  o.damping = o.armature = seed % 4 >= 2;
  return o;
}

class RandomTree : public ::testing::TestWithParam<int> {
 protected:
  RandomTree()
      : random(1000 + GetParam()),
        model(test::make_random_model(GetParam(), options(GetParam()))),
        data(model),
        q(test::random_configuration(model, random.bits())),
        v(test::random_vector(model.nv(), random.bits())),
        a(test::random_vector(model.nv(), random.bits())),
        tau(VectorX::Zero(model.nv())),
        zero(VectorX::Zero(model.nv())) {
    compute_poses(model, q, data);
    compute_velocities(model, v, data);
    compute_inertias(model, data);
  }

  /// Inverse dynamics of bodies and rotors.
  void inverse_dynamics(const VectorX& acceleration, VectorX& force) {
    rnea(model, acceleration, model.gravity(), data, force);
    force += model.armature().cwiseProduct(acceleration);
  }
  void compute_inertia(RowMatrix& M) {
    crba(model, data, M);
    M.diagonal() += model.armature();
  }

  void push_bodies() {
    data.has_external = true;
    for (int i = 1; i < model.num_bodies(); ++i) {
      const VectorX f = test::random_vector(6, random.bits());
      data.external[i] = {f.head<3>(), f.tail<3>()};
    }
  }

  test::Random random;
  Model model;
  Data data;
  VectorX q, v, a, tau, zero;
};

TEST_P(RandomTree, AbaInvertsRnea) {
  push_bodies();
  inverse_dynamics(a, tau);
  VectorX recovered = zero;
  ASSERT_TRUE(
      aba(model, tau, model.armature(), model.gravity(), moving_bodies(model), data, recovered));
  EXPECT_LT((recovered - a).norm(), kRoundoff * 1e2 * (1.0 + a.norm()));
  VectorX tau_again = zero;
  inverse_dynamics(recovered, tau_again);
  EXPECT_LT((tau_again - tau).norm(), kRoundoff * (1.0 + tau.norm()));
}

TEST_P(RandomTree, RneaIsAffineWithCrbaAsItsMatrix) {
  RowMatrix M(model.nv(), model.nv());
  compute_inertia(M);
  VectorX bias = zero;
  inverse_dynamics(zero, bias);
  inverse_dynamics(a, tau);
  EXPECT_LT((M * a + bias - tau).norm(), kRoundoff * (1.0 + tau.norm()));
  for (int j = 0; j < model.nv(); ++j) {
    VectorX column = zero;
    inverse_dynamics(VectorX::Unit(model.nv(), j), column);
    EXPECT_LT((column - bias - M.col(j)).norm(), kRoundoff * (1.0 + column.norm()));
  }
  EXPECT_EQ((M - M.transpose()).norm(), 0.0);
  EXPECT_EQ(M.llt().info(), Eigen::Success);
}

TEST_P(RandomTree, AbaWithImplicitDampingSolvesTheAugmentedSystem) {
  const VectorX extra = test::random_vector(model.nv(), random.bits()).cwiseAbs();
  RowMatrix M(model.nv(), model.nv());
  compute_inertia(M);
  VectorX bias = zero;
  inverse_dynamics(zero, bias);
  const VectorX force = test::random_vector(model.nv(), random.bits());
  ASSERT_TRUE(
      aba(model, force, model.armature() + extra, model.gravity(), moving_bodies(model), data, a));
  EXPECT_LT((M * a + extra.cwiseProduct(a) + bias - force).norm(),
            kRoundoff * (10.0 + bias.norm()));
}

TEST_P(RandomTree, KineticEnergyIsHalfVMV) {
  RowMatrix M(model.nv(), model.nv());
  compute_inertia(M);
  const double expected = 0.5 * v.dot(M * v);
  EXPECT_NEAR(kinetic_energy(model, v, data), expected, kRoundoff * (1.0 + expected));
}

TEST_P(RandomTree, BodyVelocitiesAreDerivativesOfPoses) {
  Data before(model), after(model);
  VectorX q_before = q, q_after = q;
  integrate_configuration(model, q, v, -kDifferenceStep, q_before);
  integrate_configuration(model, q, v, kDifferenceStep, q_after);
  compute_poses(model, q_before, before);
  compute_poses(model, q_after, after);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Vector3 linear =
        (after.X_WB[i].translation - before.X_WB[i].translation) / (2 * kDifferenceStep);
    const Matrix3 R_dot =
        (after.X_WB[i].rotation - before.X_WB[i].rotation) / (2 * kDifferenceStep);
    const Matrix3 omega = R_dot * data.X_WB[i].rotation.transpose();
    const double scale = 1.0 + std::pow(data.V[i].angular.norm(), 3) + data.V[i].linear.norm();
    EXPECT_LT((data.V[i].linear - linear).norm(), kDifference * scale * 10);
    EXPECT_LT((skew(data.V[i].angular) - omega).norm(), kDifference * scale * 10);
  }
}

TEST_P(RandomTree, PowerOfAppliedForcesIsTheRateOfEnergy) {
  // dE/dt = tau . v along the motion, which involves bias forces, gravity and kinematics together.
  tau = test::random_vector(model.nv(), random.bits());
  data.has_external = false;
  ASSERT_TRUE(aba(model, tau, model.armature(), model.gravity(), moving_bodies(model), data, a));
  double energy[2];
  for (int side = 0; side < 2; ++side) {
    const double h = side == 0 ? -kDifferenceStep : kDifferenceStep;
    VectorX q_side = q;
    integrate_configuration(model, q, v + 0.5 * h * a, h, q_side);
    const VectorX v_side = v + h * a;
    Data moved(model);
    compute_poses(model, q_side, moved);
    compute_velocities(model, v_side, moved);
    compute_inertias(model, moved);
    energy[side] = kinetic_energy(model, v_side, moved) + potential_energy(model, moved);
  }
  const double power = (energy[1] - energy[0]) / (2 * kDifferenceStep);
  const double scale = 1.0 + std::abs(energy[0]) + a.norm() * a.norm() + v.norm() * v.norm();
  EXPECT_NEAR(power, tau.dot(v), kDifference * 1e2 * scale);
}

TEST_P(RandomTree, ConfigurationDifferenceUndoesIntegration) {
  VectorX q_next = q, back = zero;
  integrate_configuration(model, q, v, 0.3, q_next);
  configuration_difference(model, q, q_next, back);
  EXPECT_LT((back - 0.3 * v).norm(), kRoundoff * (1.0 + v.norm()));
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomTree, ::testing::Range(0, 40));

TEST(FreeTree, MomentumChangesByGravityAlone) {
  // Internal forces move a floating robot but not its momentum, whose rate is found by differences.
  for (int seed = 0; seed < 10; ++seed) {
    test::Random random(seed);
    const Model model = test::make_random_model(seed);
    const VectorX q = test::random_configuration(model, random.bits());
    const VectorX v = test::random_vector(model.nv(), random.bits());
    VectorX tau = test::random_vector(model.nv(), random.bits()), a = tau;
    tau.head<6>().setZero();
    Data data(model);
    compute_poses(model, q, data);
    compute_velocities(model, v, data);
    compute_inertias(model, data);
    const VectorX zero = VectorX::Zero(model.nv());
    ASSERT_TRUE(aba(model, tau, model.armature(), model.gravity(), moving_bodies(model), data, a));
    Force momentum[2];
    for (int side = 0; side < 2; ++side) {
      const double h = side == 0 ? -kDifferenceStep : kDifferenceStep;
      VectorX q_side = q;
      integrate_configuration(model, q, v + 0.5 * h * a, h, q_side);
      compute_poses(model, q_side, data);
      compute_velocities(model, v + h * a, data);
      compute_inertias(model, data);
      momentum[side] = total_momentum(model, data);
    }
    compute_poses(model, q, data);
    Force weight;
    for (int b = 1; b < model.num_bodies(); ++b) {
      const SpatialInertia& inertia = model.body(b).inertia;
      const Vector3 pull = inertia.mass * model.gravity();
      weight += Force{(data.X_WB[b] * inertia.center).cross(pull), pull};
    }
    const Force rate = (momentum[1] - momentum[0]) * (0.5 / kDifferenceStep);
    const double scale = 1.0 + a.squaredNorm();
    EXPECT_LT((rate.force - weight.force).norm(), kDifference * 1e2 * scale);
    EXPECT_LT((rate.torque - weight.torque).norm(), kDifference * 1e2 * scale);
  }
}

}  // namespace
}  // namespace counterpoint::dynamics_test
