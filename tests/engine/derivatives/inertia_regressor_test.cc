// Inverse dynamics is linear in the inertial parameters.
#include "counterpoint/engine/derivatives/dynamics/inertia_regressor.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::inertia_regressor_test {
namespace {

/// Relative to the largest force: a few hundred rounding errors.
constexpr double kTolerance = 1e-12;

class RegressorOfRandomTree : public ::testing::TestWithParam<int> {};

TEST_P(RegressorOfRandomTree, TimesParametersIsTheForce) {
  const int seed = GetParam();
  const Model model = test::make_random_model(seed, test::varied_options(seed));
  const int nv = model.nv();
  test::Random random(7000 + seed);
  const VectorX q = test::random_configuration(model, random.bits());
  const VectorX v = test::random_vector(nv, random.bits(), 3.0);
  const VectorX a = test::random_vector(nv, random.bits(), 10.0);
  Data data(model);
  compute_poses(model, q, data);
  compute_velocities(model, v, data);
  VectorX tau(nv);
  rnea(model, a, model.gravity(), data, tau);
  InertiaRegressor regressor(model);
  MatrixX Y;
  regressor.compute(model, v, a, model.gravity(), data, Y);
  const VectorX pi = inertial_parameters(model);
  ASSERT_EQ(Y.rows(), nv);
  ASSERT_EQ(Y.cols(), pi.size());
  const double scale = tau.lpNorm<Eigen::Infinity>();
  EXPECT_LE((Y * pi - tau).lpNorm<Eigen::Infinity>(), kTolerance * scale);
  const std::size_t before = test::allocation_count();
  regressor.compute(model, v, a, model.gravity(), data, Y);
  EXPECT_EQ(test::allocation_count(), before);
  // Contribution of each body's parameters, column by column.
  VectorX sum = VectorX::Zero(nv);
  for (int body = 1; body < model.num_bodies(); ++body) {
    VectorX part = VectorX::Zero(nv);
    regressor.add(model, body, pi.segment<10>(10 * (body - 1)), 1.0, data, part);
    EXPECT_LE((part - Y.middleCols<10>(10 * (body - 1)) * pi.segment<10>(10 * (body - 1)))
                  .lpNorm<Eigen::Infinity>(),
              kTolerance * scale);
    sum += part;
  }
  EXPECT_LE((sum - tau).lpNorm<Eigen::Infinity>(), kTolerance * scale);

  // Without velocity-dependent forces.
  data.has_coriolis = false;
  for (Motion& c : data.c) c = Motion();
  rnea(model, a, model.gravity(), data, tau);
  regressor.compute(model, v, a, model.gravity(), data, Y);
  EXPECT_LE((Y * pi - tau).lpNorm<Eigen::Infinity>(), kTolerance * tau.lpNorm<Eigen::Infinity>());
}

INSTANTIATE_TEST_SUITE_P(Seeds, RegressorOfRandomTree, ::testing::Range(0, 40));

TEST(InertialParameters, AndInertiaAreOneAnothersReverse) {
  test::Random random(1);
  for (int i = 0; i < 20; ++i) {
    const SpatialInertia inertia = test::random_inertia(random);
    const SpatialInertia again = spatial_inertia(inertial_parameters(inertia));
    EXPECT_DOUBLE_EQ(again.mass, inertia.mass);
    EXPECT_LE((again.center - inertia.center).norm(), 1e-15 * (1.0 + inertia.center.norm()));
    // The terms of the offset of the centre of mass cancel.
    const double moved = inertia.mass * inertia.center.squaredNorm() + inertia.rotational.norm();
    EXPECT_LE((again.rotational - inertia.rotational).norm(), 1e-14 * moved);
  }
  EXPECT_THROW(spatial_inertia(InertialParameters::Zero()), InputError);
}

}  // namespace
}  // namespace counterpoint::inertia_regressor_test
