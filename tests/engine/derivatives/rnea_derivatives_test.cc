// Derivatives of inverse and forward dynamics against differences, on random trees with every joint
// type.
#include "counterpoint/engine/derivatives/dynamics/rnea_derivatives.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/derivatives/dynamics/aba_derivatives.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::rnea_derivatives_test {
namespace {

/// Central differences with Richardson extrapolation: errors of order step^4 and 1e-16 / step.
constexpr double kStep = 2e-3;
/// Relative to the largest entry.
constexpr double kTolerance = 1e-8;

double largest(const MatrixX& m) { return m.size() ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Returns the matrix whose column k is df(x + s e_k)/ds at s = 0; `f(k, s)` returns a vector.
template <class F>
MatrixX extrapolated(int n, double step, F f) {
  MatrixX d(n, n);
  for (int k = 0; k < n; ++k) {
    const VectorX near = (f(k, step) - f(k, -step)) / (2.0 * step);
    const VectorX far = (f(k, 2.0 * step) - f(k, -2.0 * step)) / (4.0 * step);
    d.col(k) = (4.0 * near - far) / 3.0;
  }
  return d;
}

test::RandomModelOptions options(int seed) {
  test::RandomModelOptions o = test::varied_options(seed);
  o.compensations = seed % 4 >= 2;
  return o;
}

class RneaDerivativesOfRandomTree : public ::testing::TestWithParam<int> {
 protected:
  RneaDerivativesOfRandomTree()
      : random(3000 + GetParam()),
        model(test::make_random_model(GetParam(), options(GetParam()))),
        data(model),
        nv(model.nv()),
        q(test::random_configuration(model, random.bits())),
        v(test::random_vector(nv, random.bits())),
        a(test::random_vector(nv, random.bits())) {
    if (GetParam() % 3 == 1) {
      data.has_external = true;
      for (int i = 1; i < model.num_bodies(); ++i)
        data.external[i] = {random.vector(3.0), random.vector(5.0)};
    }
  }

  void place(const VectorX& at, const VectorX& velocity) {
    compute_poses(model, at, data);
    compute_velocities(model, velocity, data);
    compute_inertias(model, data);
  }
  VectorX force(const VectorX& at, const VectorX& velocity, const VectorX& acceleration) {
    place(at, velocity);
    VectorX tau(nv);
    rnea(model, acceleration, model.gravity(), data, tau);
    return tau;
  }

  test::Random random;
  Model model;
  Data data;
  int nv;
  VectorX q, v, a;
};

TEST_P(RneaDerivativesOfRandomTree, AreThoseOfRnea) {
  const MatrixX by_q = extrapolated(nv, kStep, [&](int k, double s) {
    VectorX moved(model.nq());
    integrate_configuration(model, q, VectorX::Unit(nv, k), s, moved);
    return force(moved, v, a);
  });
  const MatrixX by_v = extrapolated(
      nv, kStep, [&](int k, double s) { return force(q, v + s * VectorX::Unit(nv, k), a); });
  const MatrixX by_a = extrapolated(
      nv, kStep, [&](int k, double s) { return force(q, v, a + s * VectorX::Unit(nv, k)); });
  place(q, v);
  RneaDerivator derivator(model);
  RneaDerivatives d;
  derivator.compute(model, v, a, model.gravity(), data, d);
  EXPECT_LE(largest(d.dq - by_q), kTolerance * (1.0 + largest(by_q)));
  EXPECT_LE(largest(d.dv - by_v), kTolerance * (1.0 + largest(by_v)));
  EXPECT_LE(largest(d.da - by_a), kTolerance * (1.0 + largest(by_a)));
  const std::size_t before = test::allocation_count();
  derivator.compute(model, v, a, model.gravity(), data, d);
  EXPECT_EQ(test::allocation_count(), before);
}

TEST_P(RneaDerivativesOfRandomTree, OnesOfAbaAreThoseOfAba) {
  const VectorX diagonal = VectorX::Constant(nv, 0.1), tau = a;
  const auto acceleration = [&](const VectorX& at, const VectorX& velocity, const VectorX& f) {
    place(at, velocity);
    VectorX out(nv);
    EXPECT_TRUE(aba(model, f, diagonal, model.gravity(), moving_bodies(model), data, out));
    return out;
  };
  const MatrixX by_q = extrapolated(nv, kStep, [&](int k, double s) {
    VectorX moved(model.nq());
    integrate_configuration(model, q, VectorX::Unit(nv, k), s, moved);
    return acceleration(moved, v, tau);
  });
  const MatrixX by_v = extrapolated(nv, kStep, [&](int k, double s) {
    return acceleration(q, v + s * VectorX::Unit(nv, k), tau);
  });
  const MatrixX by_tau = extrapolated(nv, kStep, [&](int k, double s) {
    return acceleration(q, v, tau + s * VectorX::Unit(nv, k));
  });
  const VectorX at = acceleration(q, v, tau);
  AbaDerivator derivator(model);
  AbaDerivatives d;
  ASSERT_TRUE(derivator.compute(model, v, at, diagonal, model.gravity(), data, d));
  // Joints close to each other make inverse inertias, and with them fourth derivatives, large.
  EXPECT_LE(largest(d.dq - by_q), 10.0 * kTolerance * (1.0 + largest(by_q)));
  EXPECT_LE(largest(d.dv - by_v), 10.0 * kTolerance * (1.0 + largest(by_v)));
  EXPECT_LE(largest(d.dtau - by_tau), kTolerance * (1.0 + largest(by_tau)));
  const std::size_t before = test::allocation_count();
  ASSERT_TRUE(derivator.compute(model, v, at, diagonal, model.gravity(), data, d));
  EXPECT_EQ(test::allocation_count(), before);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RneaDerivativesOfRandomTree, ::testing::Range(0, 40));

}  // namespace
}  // namespace counterpoint::rnea_derivatives_test
