#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "contact/trials.h"
#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::law_test {
namespace {

using testing::for_trials;
using testing::kDifferenceStep;
using testing::kDifferenceTolerance;
using testing::kEveryType;
using testing::Random;
using testing::random_law;
using testing::RandomOptions;

// A law soft and smooth enough for differences with kDifferenceStep to resolve its curvature.
Law smooth_law(Random& random, LawType type, bool coulomb) {
  RandomOptions options;
  options.coulomb = coulomb;
  Law law = random_law(random, options, type);
  law.regularizer = random.log_uniform(0.05, 2.0);
  law.smoothing = random.log_uniform(0.05, 2.0);
  law.bound = random.log_uniform(0.1, 2.0);
  return law;
}

Rows random_velocity(Random& random, const Law& law, double scale = 1.0) {
  Rows y(law.rows);
  for (int i = 0; i < law.rows; ++i) y[i] = scale * random.signed_unit();
  return y;
}

TEST(ScalarLaw, SolvesItsEquationWithoutCancellation) {
  for_trials(1, 20000, [&](Random& random, int) {
    const double r = random.log_uniform(1e-10, 1e2), k = random.log_uniform(1e-16, 1e2);
    const double lambda = random.signed_unit() * random.log_uniform(1e-12, 1e4);
    const ScalarLaw law(lambda, r, k);
    // r g + lambda = k / g, relative to its largest term; each term is accurate to a few ulps.
    const double scale = std::max({r * law.g, std::abs(lambda), k / law.g});
    EXPECT_NEAR(r * law.g + lambda, k / law.g, 1e-15 * 4 * scale);
    // s equals the sum of the two positive terms.
    EXPECT_NEAR(law.s, r * law.g + k / law.g, 4e-15 * law.s);
  });
}

TEST(ScalarLaw, HasItsTwoLimits) {
  EXPECT_EQ(ScalarLaw(-0.5, 0.25, 0.0).g, 2.0);  // k = 0: projection
  EXPECT_EQ(ScalarLaw(0.5, 0.25, 0.0).g, 0.0);
  EXPECT_EQ(ScalarLaw(0.5, 0.0, 0.25).g, 0.5);  // r = 0: log barrier k / lambda
  EXPECT_EQ(ScalarLaw(0.0, 0.25, 0.0).a, 2.0);  // at the corner: half of 1 / r
}

TEST(Law, ImpulseIsMinusTheGradientOfThePotential) {
  for_trials(2, 4000, [&](Random& random, int trial) {
    const Law law = smooth_law(random, kEveryType[trial % 4], false);
    const Rows y = random_velocity(random, law);
    const Rows f = impulse(law, y);
    for (int i = 0; i < law.rows; ++i) {
      Rows up = y, down = y;
      up[i] += kDifferenceStep;
      down[i] -= kDifferenceStep;
      const double difference =
          (potential(law, up.data()) - potential(law, down.data())) / (2 * kDifferenceStep);
      EXPECT_NEAR(f[i], -difference, kDifferenceTolerance * (1 + f.norm()));
    }
  });
}

TEST(Law, HessianIsMinusTheDerivativeOfTheImpulse) {
  for_trials(3, 8000, [&](Random& random, int trial) {
    const Law law = smooth_law(random, kEveryType[trial % 4], trial % 8 >= 4);
    const Rows y = random_velocity(random, law);
    const Evaluation at = evaluate(law, y);
    for (int j = 0; j < law.rows; ++j) {
      Rows up = y, down = y;
      up[j] += kDifferenceStep;
      down[j] -= kDifferenceStep;
      const Rows difference = (impulse(law, up) - impulse(law, down)) / (2 * kDifferenceStep);
      EXPECT_LT((at.hessian.col(j) + difference).norm(),
                kDifferenceTolerance * (1 + at.hessian.norm()))
          << "type " << static_cast<int>(law.type) << " coulomb " << law.coulomb;
    }
  });
}

TEST(Law, SlopeIsTheHessianAlongALine) {
  for_trials(4, 4000, [&](Random& random, int trial) {
    const Law law = smooth_law(random, kEveryType[trial % 4], trial % 8 >= 4);
    const Rows y = random_velocity(random, law), d = random_velocity(random, law);
    const Evaluation at = evaluate(law, y);
    const Slope s = slope(law, y.data(), d.data());
    EXPECT_NEAR(s.first, -at.impulse.dot(d), 1e-13 * (1 + at.impulse.norm()));
    EXPECT_NEAR(s.second, d.dot(at.hessian * d), 1e-13 * (1 + at.hessian.norm()));
  });
}

TEST(Law, HessianIsPositiveSemidefinite) {
  RandomOptions options;
  options.max_friction = 10.0;
  for_trials(5, 20000, [&](Random& random, int trial) {
    Law law = random_law(random, options, kEveryType[trial % 4]);
    law.regularizer = random.log_uniform(1e-8, 1e1);
    law.smoothing = random.coin() ? 0.0 : random.log_uniform(1e-16, 1e1);
    law.bound = random.uniform(0, 10);
    const Rows y = random_velocity(random, law, random.log_uniform(1e-9, 1e2));
    const RowsSquare hessian = evaluate(law, y).hessian;
    EXPECT_EQ(hessian, hessian.transpose());
    const Eigen::SelfAdjointEigenSolver<MatrixX> eigen(MatrixX{hessian});
    EXPECT_GE(eigen.eigenvalues()[0],
              -1e-14 * hessian.norm());  // eigenvalues are accurate to a few ulps
  });
}

TEST(Law, ImpulseLiesInItsCone) {
  RandomOptions options;
  options.max_friction = 10.0;
  for_trials(6, 40000, [&](Random& random, int trial) {
    options.coulomb = random.coin();
    Law law = random_law(random, options,
                         trial % 2 == 0 ? LawType::kFrictionCone : LawType::kDryFriction);
    law.regularizer = random.log_uniform(1e-8, 1e1);
    law.smoothing = random.coin() ? 0.0 : random.log_uniform(1e-16, 1e1);
    law.bound = random.uniform(0, 10);
    const Rows y = random_velocity(random, law, random.log_uniform(1e-9, 1e2));
    const Rows f = impulse(law, y);
    constexpr double kUlps = 1 + 1e-14;
    if (law.type == LawType::kDryFriction) {
      EXPECT_LE(std::abs(f[0]), law.bound * kUlps);
      return;
    }
    double phi = 0.0;
    for (int i = 1; i < law.rows; ++i) {
      if (law.friction[i - 1] == 0.0) {
        EXPECT_EQ(f[i], 0.0);
      } else {
        phi += std::pow(f[i] / law.friction[i - 1], 2);
      }
    }
    EXPECT_LE(std::sqrt(phi), f[0] * kUlps);
  });
}

TEST(Law, WithoutFrictionTheNormalRowIsTheUnilateralLaw) {
  for_trials(7, 1000, [&](Random& random, int) {
    Law cone;
    cone.type = LawType::kFrictionCone;
    cone.rows = 3;
    cone.coulomb = random.coin();
    cone.regularizer = random.log_uniform(1e-6, 1.0);
    cone.smoothing = random.coin() ? 0.0 : random.log_uniform(1e-9, 1.0);
    Law row;
    row.regularizer = normal_regularizer(cone);
    row.smoothing = cone.smoothing;
    const Rows y = random_velocity(random, cone);
    const Rows f = impulse(cone, y);
    EXPECT_EQ(f[0], impulse(row, Rows(y.head(1)))[0]);
    EXPECT_EQ(f[1], 0.0);
    EXPECT_EQ(f[2], 0.0);
  });
}

TEST(Law, HardConvexLawIsTheRegularizedProjection) {
  // For k = 0, f minimizes 1/2 f'R f + f'y over the cone, so R f + y lies in the dual cone and is
  // orthogonal to f.
  RandomOptions options;
  for_trials(8, 10000, [&](Random& random, int) {
    Law law = random_law(random, options, LawType::kFrictionCone);
    law.regularizer = random.log_uniform(1e-4, 1.0);
    const Rows y = random_velocity(random, law);
    const Rows f = impulse(law, y);
    const double rho = normal_regularizer(law);
    double z = 0.0, power = f[0] * (y[0] + rho * f[0]);
    for (int i = 1; i < law.rows; ++i) {
      const double mu = law.friction[i - 1];
      if (mu == 0.0) continue;
      const double v = y[i] + rho / (mu * mu) * f[i];
      z += std::pow(mu * v, 2);
      power += f[i] * v;
    }
    const double scale = 1 + rho * f.norm();
    EXPECT_LE(std::sqrt(z), y[0] + rho * f[0] + 1e-13 * scale);
    EXPECT_NEAR(power, 0.0, 1e-12 * scale * (1 + f.norm()));
  });
}

TEST(Law, DryFrictionIsTheClampInTheHardLimit) {
  Law law;
  law.type = LawType::kDryFriction;
  law.bound = 2.0;
  law.regularizer = 0.1;
  for (const double y : {-5.0, -0.2001, -0.1, 0.0, 0.05, 0.199, 3.0}) {
    EXPECT_NEAR(impulse(law, Rows::Constant(1, y))[0], -std::clamp(y / 0.1, -2.0, 2.0), 1e-14);
  }
}

TEST(Law, SmoothingVanishesAtTheExpectedRate) {
  // |f_k - f_0| of the scalar law is at most sqrt(k / r), reached at lambda = 0, and about k /
  // |lambda| elsewhere.
  Law law;
  law.regularizer = 1e-3;
  for (const double y : {-0.5, 0.0, 0.5}) {
    const Rows at = Rows::Constant(1, y);
    law.smoothing = 0.0;
    const double hard = impulse(law, at)[0];
    for (double k = 1e-4; k > 1e-13; k *= 0.1) {
      law.smoothing = k;
      const double expected = y == 0.0 ? std::sqrt(k / law.regularizer) : k / std::abs(y);
      // The next term is k^2 r / |y|^3 <= 4e-7; `hard` is about 500 with an error of 1e-13.
      EXPECT_NEAR(impulse(law, at)[0] - hard, expected, 1e-6 * expected + 2e-13);
    }
  }
}

TEST(Law, ExtremeVelocitiesGiveFiniteNumbers) {
  Random random(9);
  for (const LawType type : kEveryType) {
    for (const double size : {0.0, 1e-300, 1e-30, 1e10, 1e100}) {
      for (const double k : {0.0, 1e-300, 1e-10}) {
        for (const bool coulomb : {false, true}) {
          RandomOptions options;
          options.coulomb = coulomb;
          Law law = random_law(random, options, type);
          law.regularizer = 1e-6;
          law.smoothing = k;
          law.bound = 1.0;
          const Evaluation at = evaluate(law, random_velocity(random, law, size));
          EXPECT_TRUE(at.impulse.allFinite()) << size << " " << k;
          EXPECT_TRUE(at.hessian.allFinite()) << size << " " << k;
        }
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::contact::law_test
