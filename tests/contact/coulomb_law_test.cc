// Regularized Coulomb friction of one contact: the decoupled law of cones.h.
#include <gtest/gtest.h>

#include "contact/rounding.h"
#include "contact/trials.h"
#include "counterpoint/contact/laws/cones.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::coulomb_law_test {
namespace {

using testing::for_trials;
using testing::kUnit;
using testing::Random;
using testing::random_law;
using testing::RandomOptions;

// Each operation of the law is accurate to a unit in the last place of its largest term.
constexpr double kRounding = 32.0 * kUnit;

struct Sample {
  int rows;
  double z[kMaxRows];
};

Sample random_velocity(Random& random) {
  Sample out{random.integer(2, kMaxRows), {}};
  const double size = random.log_uniform(1e-9, 1e2);
  for (int i = 0; i < out.rows; ++i) out.z[i] = size * random.signed_unit();
  return out;
}

// Evaluates phi at z for regularizers rho_N and rho and slip speed v; returns |phi_T|.
double scaled_impulse(const Sample& at, double rho_N, double rho, double v, double k, double* phi) {
  const CoulombCone<double> cone =
      cone_at<CoulombCone>(ConeLaw<double>{rho_N, rho, v, k}, at.rows, at.z);
  phi[0] = cone.n;
  for (int i = 1; i < at.rows; ++i) phi[i] = -cone.b * at.z[i];
  return cone.p;
}

Law random_coulomb(Random& random) {
  RandomOptions options;
  options.coulomb = true;
  Law law = random_law(random, options, LawType::kFrictionCone);
  law.regularizer = random.log_uniform(1e-8, 1e1);
  law.smoothing = random.coin() ? 0.0 : random.log_uniform(1e-16, 1e1);
  return law;
}

// phi = F_rho(z) equals phi = F_sigma(z - (sigma - rho) phi), with and without smoothing, for any
// regularizers of normal and friction. The mixed method relies on this identity.
TEST(CoulombLaw, IsTheSameLawWhenItIsWidened) {
  double worst = 0.0;
  for_trials(1, 40000, [&](Random& random, int) {
    const Sample at = random_velocity(random);
    const double rho_N = random.log_uniform(1e-9, 1.0), rho = random.log_uniform(1e-9, 1.0);
    const double sigma_N = rho_N * random.log_uniform(1.0, 1e6);
    const double sigma = rho * random.log_uniform(1.0, 1e6);
    const double v = random.coin() ? 0.0 : random.log_uniform(1e-9, 1e2);
    const double k = random.coin() ? 0.0 : random.log_uniform(1e-16, 1e2);
    double phi[kMaxRows], wide_phi[kMaxRows], size = 0.0;
    scaled_impulse(at, rho_N, rho, v, k, phi);
    Sample wide = at;
    for (int i = 0; i < at.rows; ++i) {
      const double sigma_i = i > 0 ? sigma : sigma_N, rho_i = i > 0 ? rho : rho_N;
      wide.z[i] -= (sigma_i - rho_i) * phi[i];
      // The argument has its own round-off and that of its terms. F_sigma has slopes below 1 /
      // sigma, and friction follows the normal impulse with a slope below one.
      size = std::max(size, (std::abs(at.z[i]) + sigma_i * std::abs(phi[i])) / sigma_i);
    }
    scaled_impulse(wide, sigma_N, sigma, v, k, wide_phi);
    for (int i = 0; i < at.rows; ++i) {
      EXPECT_NEAR(phi[i], wide_phi[i], kRounding * size) << i;
      worst = std::max(worst, std::abs(phi[i] - wide_phi[i]) / (kUnit * size));
    }
  });
  ::testing::Test::RecordProperty("worst_in_units", std::to_string(worst));
}

TEST(CoulombLaw, NormalImpulseIsThatOfTheUnilateralLawToTheBit) {
  for_trials(2, 10000, [&](Random& random, int) {
    const Law law = random_coulomb(random);
    Law normal;
    normal.regularizer = normal_regularizer(law);
    normal.smoothing = law.smoothing;
    Rows y(law.rows);
    for (int i = 0; i < law.rows; ++i) y[i] = random.signed_unit();
    const Evaluation at = evaluate(law, y);
    EXPECT_EQ(at.impulse[0], impulse(normal, Rows(y.head(1)))[0]);
    for (int j = 1; j < law.rows; ++j) EXPECT_EQ(at.hessian(0, j), 0.0);
    for (int j = 1; j < law.rows; ++j) y[j] *= 1e3;
    EXPECT_EQ(impulse(law, y)[0], at.impulse[0]);
  });
}

// Friction opposes the sliding velocity and does not exceed the normal impulse.
TEST(CoulombLaw, FrictionIsBoundedByTheNormalImpulseAndOpposesMotion) {
  for_trials(3, 40000, [&](Random& random, int) {
    const Sample at = random_velocity(random);
    const double rho = random.log_uniform(1e-9, 1.0);
    const double v = random.coin() ? 0.0 : random.log_uniform(1e-9, 1e2);
    const double k = random.coin() ? 0.0 : random.log_uniform(1e-16, 1e2);
    double phi[kMaxRows];
    const double p = scaled_impulse(at, rho * random.log_uniform(1e-3, 1e3), rho, v, k, phi);
    EXPECT_LE(p, phi[0] * (1.0 + kRounding));
    for (int i = 1; i < at.rows; ++i) EXPECT_LE(phi[i] * at.z[i], 0.0);
  });
}

// A cone of half the friction, tilted by lean = mu / 2 along e: full friction against sliding along
// e, none in the other direction. With any previous velocity L e, the power at the mean velocity is
// dissipative.
TEST(CoulombLaw, LeaningByHalfItOnlyBrakes) {
  constexpr double kYields = 1e-9;  // normal velocity from the compliance [m/s]
  for_trials(7, 20000, [&](Random& random, int) {
    Law law;
    law.type = LawType::kFrictionCone;
    law.rows = 3;
    law.coulomb = true;
    const double mu = random.uniform(0.1, 2.0), angle = random.uniform(0.0, 6.3);
    const double e[2] = {std::cos(angle), std::sin(angle)};
    law.friction = {0.5 * mu, 0.5 * mu};
    law.lean = {0.5 * mu * e[0], 0.5 * mu * e[1]};
    law.regularizer = random.log_uniform(1e-8, 1e-2);
    ASSERT_TRUE(is_valid(law));
    Rows y(3);
    for (int i = 0; i < 3; ++i) y[i] = random.signed_unit();
    y[0] = -kYields;
    const double before = random.log_uniform(1e-3, 1e3);
    const Rows f = impulse(law, y);
    const double power = f[1] * (y[1] + before * e[0]) + f[2] * (y[2] + before * e[1]);
    // Below 2 kYields / mu the contact sticks and yields to the force; each term has round-off.
    EXPECT_LE(power, (2.0 * kYields + kRounding * mu * (before + 2.0)) * f[0]);
    EXPECT_LE(std::hypot(f[1], f[2]), mu * f[0] * (1.0 + kRounding));
    const Rows against = impulse(law, Rows(Eigen::Vector3d(-1.0, 1e3 * e[0], 1e3 * e[1])));
    EXPECT_NEAR(against[1], -mu * against[0] * e[0], kRounding * mu * against[0]);
  });
}

// Without smoothing, at v = z + rho phi (z up to the compliance): Signorini's conditions, the cone
// constraint, and maximum dissipation -phi_T . v_T = phi_N |v_T|.
TEST(CoulombLaw, WithoutSmoothingItIsTheHardLawUpToTheCompliance) {
  for_trials(4, 40000, [&](Random& random, int) {
    const Sample at = random_velocity(random);
    const double rho_N = random.log_uniform(1e-9, 1.0), rho = random.log_uniform(1e-9, 1.0);
    double phi[kMaxRows];
    const double p = scaled_impulse(at, rho_N, rho, 0.0, 0.0, phi);
    const double v_N = at.z[0] + rho_N * phi[0];
    EXPECT_GE(phi[0], 0.0);
    EXPECT_GE(v_N, -kRounding * std::abs(at.z[0]));
    EXPECT_LE(std::abs(phi[0] * v_N), kRounding * phi[0] * std::abs(at.z[0]));
    double square = 0.0, power = 0.0, size = 0.0;
    for (int i = 1; i < at.rows; ++i) {
      const double v = at.z[i] + rho * phi[i];
      square += v * v;
      power -= phi[i] * v;
      size += std::abs(at.z[i]) + rho * std::abs(phi[i]);
    }
    EXPECT_LE(p, phi[0] * (1.0 + kRounding));
    EXPECT_NEAR(power, phi[0] * std::sqrt(square), kRounding * phi[0] * size);
  });
}

// |phi_T| differs from the clamp of |z_T| / rho to [0, phi_N] by sqrt(k / rho) at most: by rho p +
// (k / n) p / (n - p) = t the distance d to the bound satisfies rho d^2 <= k, and n grows by no
// more. phi_N differs from the projection by at most as much, or by k / |z_N| if that is less.
TEST(CoulombLaw, SmoothingVanishesAtTheExpectedRate) {
  for_trials(5, 20000, [&](Random& random, int) {
    const Sample at = random_velocity(random);
    const double rho = random.log_uniform(1e-6, 1.0);
    double hard[kMaxRows], smooth[kMaxRows];
    const double hard_p = scaled_impulse(at, rho, rho, 0.0, 0.0, hard);
    double square = 0.0;
    for (int i = 1; i < at.rows; ++i) square += at.z[i] * at.z[i];
    const double clamp = std::min(std::sqrt(square) / rho, hard[0]);
    EXPECT_NEAR(hard_p, clamp, kRounding * clamp);
    for (double k = 1e-2; k > 1e-16; k *= 1e-2) {
      const double p = scaled_impulse(at, rho, rho, 0.0, k, smooth);
      const double most = std::sqrt(k / rho), rounding = kRounding * (smooth[0] + most);
      EXPECT_LE(std::abs(p - hard_p), most + rounding) << k;
      EXPECT_LE(std::abs(smooth[0] - hard[0]), std::min(most, k / std::abs(at.z[0])) + rounding)
          << k;
    }
  });
}

// At a share sigma of the cone the slip is sigma v above that of the compliance, for any load.
TEST(CoulombLaw, SlipSpeedIsReachedAtTheBoundWhateverTheLoad) {
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.coulomb = true;
  law.friction = {0.5, 0.5};
  law.regularizer = 1e-12;
  law.slip_speed = 1e-3;
  for (const double load : {1e-3, 1.0, 1e6}) {
    Rows y(3);
    y[0] = -normal_regularizer(law) * load;
    y[2] = 0.0;
    for (const double share : {0.1, 0.5, 0.99}) {
      y[1] = share * (law.slip_speed + law.regularizer * 0.5 * load);
      const Rows f = impulse(law, y);
      EXPECT_NEAR(f[0], load, kRounding * load);
      EXPECT_NEAR(-f[1], share * 0.5 * load, kRounding * load) << load << " " << share;
    }
    y[1] = 2.0 * (law.slip_speed + law.regularizer * load);
    EXPECT_NEAR(-impulse(law, y)[1], 0.5 * load, kRounding * load);
  }
  // Without load there is no friction and no division by zero.
  Rows open(3);
  open << 1.0, 2.0, 0.0;
  EXPECT_EQ(impulse(law, open), Rows(Rows::Zero(3)));
  EXPECT_TRUE(evaluate(law, open).hessian.allFinite());
}

TEST(CoulombLaw, SlidesAgainstTheVelocityWithoutOpeningTheContact) {
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.coulomb = true;
  law.friction = {0.5, 0.5};
  law.regularizer = 1e-6;
  Rows y(3);
  y << -1e-6, 2.0, 0.0;  // slides at 2 m/s with a negligible normal velocity
  const Rows f = impulse(law, y);
  EXPECT_NEAR(f[0], 1e-6 / (0.25 * 1e-6), 1e-14);  // -y_N / (mu^2 r)
  EXPECT_NEAR(f[1], -0.5 * f[0], 1e-15);
  y[0] = 1e-6;
  EXPECT_EQ(impulse(law, y)[0], 0.0);  // any gap opens the contact
  law.coulomb = false;
  EXPECT_GT(impulse(law, y)[0], 1e5);  // the convex law would separate it at mu |v_T|
}

}  // namespace
}  // namespace counterpoint::contact::coulomb_law_test
