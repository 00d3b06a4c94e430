// The kinetic-energy formulation of 2011: its solution minimizes the published cost, edge cases are
// solved, and its inverse returns the input of its forward solution.
#include "accuracy/kinetic_energy/kinetic_energy.h"

#include <gtest/gtest.h>

#include <limits>
#include <ostream>
#include <string>

#include "apps/accuracy/random_kinetic_energy.h"
#include "contact/rounding.h"
#include "contact/trials.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::kinetic_energy_test {
namespace {

using testing::for_trials;
using testing::KineticEnergyCase;
using testing::kUnit;
using testing::law_rounding;
using testing::Random;
using testing::random_kinetic_energy;
using testing::RandomKineticEnergyOptions;

// Gradient of the published cost in f at the solution, v + R f + A grad q + k grad barrier = 0,
// without any of the solver's variables. Friction cones only, k > 0. `size` receives the sum of the
// magnitudes of the terms.
VectorX cost_gradient(const KineticEnergyProblem& problem, const VectorX& c, const VectorX& f,
                      VectorX& size) {
  const VectorX v = c + problem.A * f;
  VectorX gradient = v;
  size = c.cwiseAbs() + problem.A.cwiseAbs() * f.cwiseAbs();
  int row = 0;
  for (size_t i = 0; i < problem.laws.size(); ++i) {
    const Law& law = problem.laws[i];
    const double s = v[row] + problem.gap_speed[i], s0 = problem.continuation_speed;
    const double k = problem.velocity_smoothing;
    const double slope = s >= s0 ? -k / s : -k / s0 + k / (s0 * s0) * (s - s0);
    gradient += slope * problem.A.col(row);
    size += std::abs(slope) * problem.A.col(row).cwiseAbs();
    const double rho = normal_regularizer(law);
    double inside = f[row] * f[row];
    for (int r = 1; r < law.rows; ++r) inside -= std::pow(f[row + r] / law.friction[r - 1], 2);
    for (int r = 0; r < law.rows; ++r) {
      const double mu = r == 0 ? 1.0 : law.friction[r - 1], sign = r == 0 ? 1.0 : -1.0;
      const double weighted = f[row + r] / (mu * mu);
      gradient[row + r] += rho * weighted - law.smoothing * sign * weighted / inside;
      size[row + r] += rho * std::abs(weighted) + law.smoothing * std::abs(weighted) / inside;
    }
    row += law.rows;
  }
  return gradient;
}

TEST(KineticEnergy, SolutionMinimizesTheCostAsPublished) {
  for_trials(1, 500, [](Random& random, int) {
    RandomKineticEnergyOptions options;
    options.only_cones = true;
    options.min_friction = 0.1;
    options.max_friction = 1.5;
    options.compliance_low = 1e-4;
    options.smoothing_low = 1e-3;  // keeps f away from its cone's boundary, where `inside` cancels
    const KineticEnergyCase at = random_kinetic_energy(random, options);
    const KineticEnergyResult forward = solve_kinetic_energy(at.problem, at.c, Settings{});
    ASSERT_TRUE(succeeded(forward.status)) << status_name(forward.status);
    VectorX size;
    const VectorX gradient = cost_gradient(at.problem, at.c, forward.f, size);
    // The tolerance 1e-10 holds for impulses; R and A q'' turn them into velocities, and `inside`
    // loses up to 1e-4 of f_N^2 here.
    constexpr double kTolerance = 1e-7;
    EXPECT_LE(gradient.norm(), kTolerance * size.norm());
  });
}

TEST(KineticEnergy, WithoutFrictionOneContactIsAScalarEquation) {
  // Scalar equation r f + v - a k_q / (v + g) = k / f with v = c + a f, solved by bisection.
  for_trials(2, 200, [](Random& random, int) {
    const double a = random.log_uniform(1e-3, 1e3), c = random.signed_unit();
    KineticEnergyProblem problem;
    problem.A = MatrixX::Constant(1, 1, a);
    Law law;
    // With a smaller regularizer the round-off of v (1e-16), amplified by a q'' <= 400 and a / r,
    // would show.
    law.regularizer = a * random.log_uniform(1e-3, 1e-1);
    law.smoothing = random.log_uniform(1e-4, 1e-2) / a;
    problem.laws = {law};
    problem.gap_speed = {random.uniform(-0.2, 0.5)};
    problem.velocity_smoothing = random.log_uniform(1e-4, 1e-2) / a;
    problem.continuation_speed = 1e-12;  // below any speed that occurs
    const auto slope = [&](double f) {
      const double v = c + a * f;
      return law.regularizer * f + v - a * problem.velocity_smoothing / (v + problem.gap_speed[0]) -
             law.smoothing / f;
    };
    double low = std::max(0.0, -(c + problem.gap_speed[0]) / a), high = low + 10.0 / a;
    for (int i = 0; i < 200; ++i) {
      const double middle = 0.5 * (low + high);
      (slope(middle) > 0.0 ? high : low) = middle;
    }
    const KineticEnergyResult forward =
        solve_kinetic_energy(problem, VectorX::Constant(1, c), Settings{});
    ASSERT_TRUE(succeeded(forward.status));
    EXPECT_NEAR(forward.f[0], high,
                1e-9 * (high + 1.0 / a));  // relative to the momentum of 1 m/s, 1/a
  });
}

TEST(KineticEnergy, RegularizerGrowsWithTheGap) {
  EXPECT_EQ(distant_regularizer(1e-3, -0.1, 0.2), 1e-3);
  EXPECT_DOUBLE_EQ(distant_regularizer(1e-3, 0.2, 0.2), 2e-3);
}

TEST(KineticEnergy, ImpulsesLieInTheirCones) {
  for_trials(3, 300, [](Random& random, int) {
    const KineticEnergyCase at = random_kinetic_energy(random, RandomKineticEnergyOptions{});
    const VectorX f = invert_kinetic_energy(at.problem, at.c).f;
    int row = 0;
    for (const Law& law : at.problem.laws) {
      constexpr double kUlps = 1 + 1e-14;
      if (law.type == LawType::kDryFriction) {
        EXPECT_LE(std::abs(f[row]), law.bound * kUlps);
      }
      if (law.type == LawType::kFrictionCone) {
        double phi = 0.0;
        for (int r = 1; r < law.rows; ++r) {
          if (law.friction[r - 1] > 0.0) phi += std::pow(f[row + r] / law.friction[r - 1], 2);
        }
        EXPECT_LE(std::sqrt(phi), f[row] * kUlps);
      }
      row += law.rows;
    }
  });
}

TEST(KineticEnergy, EdgesAreSolved) {
  KineticEnergyProblem problem;
  EXPECT_EQ(solve_kinetic_energy(problem, VectorX(), Settings{}).status, Status::kConverged);
  // A contact that cannot move keeps the free velocity: v = c.
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.friction = {0.5, 0.5};
  law.regularizer = 1e-3;
  problem.laws = {law};
  problem.gap_speed = {0.0};
  problem.A = MatrixX::Zero(3, 3);
  const VectorX c = VectorX::Constant(3, -1.0);
  KineticEnergyResult result = solve_kinetic_energy(problem, c, Settings{});
  EXPECT_EQ(result.status, Status::kConverged);
  EXPECT_EQ(result.v, c);
  // The free velocity is zero.
  problem.A.setIdentity();
  result = solve_kinetic_energy(problem, VectorX::Zero(3), Settings{});
  EXPECT_TRUE(succeeded(result.status));
  EXPECT_EQ(invert_kinetic_energy(problem, result.v).f, result.f);
}

TEST(KineticEnergy, WhatMakesNoSenseIsReported) {
  Random random(4);
  RandomKineticEnergyOptions options;
  options.only_cones = true;
  const KineticEnergyCase good = random_kinetic_energy(random, options);
  const auto status = [&](const auto& spoil) {
    KineticEnergyCase bad = good;
    spoil(bad);
    return solve_kinetic_energy(bad.problem, bad.c, Settings{}).status;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using Case = KineticEnergyCase;
  EXPECT_EQ(status([&](Case& bad) { bad.c[0] = nan; }), Status::kNotFinite);
  EXPECT_EQ(status([&](Case& bad) { bad.problem.A(0, 0) = nan; }), Status::kNotFinite);
  EXPECT_EQ(status([&](Case& bad) { bad.problem.laws[0].smoothing = nan; }), Status::kNotFinite);
  EXPECT_EQ(status([&](Case& bad) { bad.problem.gap_speed[0] = nan; }), Status::kNotFinite);
  EXPECT_EQ(status([](Case& bad) { bad.problem.laws[0].coulomb = true; }), Status::kInvalidLaw);
  EXPECT_EQ(status([](Case& bad) { bad.problem.laws[0].regularizer = 0.0; }), Status::kInvalidLaw);
  EXPECT_EQ(status([](Case& bad) { bad.problem.velocity_smoothing = 0.0; }), Status::kInvalidLaw);
  EXPECT_EQ(status([](Case& bad) { bad.problem.gap_speed.push_back(0.0); }), Status::kInvalidLaw);
  EXPECT_EQ(status([](Case& bad) { bad.c.conservativeResize(1); }), Status::kInvalidLaw);
  Settings none;
  none.max_iterations = 1;
  EXPECT_EQ(solve_kinetic_energy(good.problem, good.c, none).status, Status::kMaxIterations);
}

// Bound on |df| of the 2011 inverse for a v that is wrong by its round-off, amplified by the
// curvature of the bound.
VectorX kinetic_energy_rounding(const KineticEnergyCase& at, const VectorX& v, const VectorX& f) {
  const KineticEnergyProblem& problem = at.problem;
  const MatrixX size = problem.A.cwiseAbs();
  const double operations = static_cast<double>(v.size()) + 2.0;
  const VectorX dv = operations * kUnit * (at.c.cwiseAbs() + v.cwiseAbs() + size * f.cwiseAbs());
  VectorX y = v, dy = dv;
  int row = 0;
  for (size_t i = 0; i < problem.laws.size(); ++i) {
    const Law& law = problem.laws[i];
    if (law.type == LawType::kUnilateral || law.type == LawType::kFrictionCone) {
      const double s0 = problem.continuation_speed, k = problem.velocity_smoothing;
      const double s = v[row] + problem.gap_speed[i];
      const double p = s >= s0 ? k / s : k / s0 - k / (s0 * s0) * (s - s0);
      const double stiffness = s >= s0 ? k / (s * s) : k / (s0 * s0);
      y -= p * problem.A.col(row);
      dy += (stiffness * (dv[row] + kUnit * std::abs(problem.gap_speed[i])) +
             operations * kUnit * p) *
            size.col(row);
    }
    row += law.rows;
  }
  VectorX df(v.size());
  row = 0;
  for (const Law& law : problem.laws) {
    const int n = law.rows;
    Rows at_law = y.segment(row, n);
    for (int r = 0; r < n; ++r) at_law[r] += law.bias[r];
    df.segment(row, n) = law_rounding(law, at_law, dy.segment(row, n));
    row += n;
  }
  return df;
}

constexpr double kReturned =
    1e-9;  // relative tolerance of the inverse, as in the forward-inverse theorem of contact/
// A step that stops at the round-off floor may be this many floors away (kFloorFactor in
// kinetic_energy_newton.cc).
constexpr double kFloor = 4.0;

struct Range {
  const char* name;
  double compliance_low, smoothing_low;
  double floor_dominates;  // largest share of the trials; small smoothing makes a q'' amplify
                           // round-off
};

void PrintTo(const Range& range, std::ostream* out) { *out << range.name; }

class KineticEnergyForwardInverse : public ::testing::TestWithParam<Range> {};

TEST_P(KineticEnergyForwardInverse, ReturnsTheFreeVelocity) {
  constexpr int kTrials = 4000;
  RandomKineticEnergyOptions options;
  options.compliance_low = GetParam().compliance_low;
  options.smoothing_low = GetParam().smoothing_low;
  int floor_dominates = 0;
  int unsolved = 0;
  std::string trials;
  for_trials(3, kTrials, [&](Random& random, int trial) {
    const KineticEnergyCase at = random_kinetic_energy(random, options);
    const KineticEnergyResult forward = solve_kinetic_energy(at.problem, at.c, Settings{});
    if (!succeeded(forward.status)) {
      ++unsolved;
      trials.append(" ").append(std::to_string(trial));
      return;
    }
    const KineticEnergyResult inverse = invert_kinetic_energy(at.problem, forward.v);
    EXPECT_EQ(inverse.f, forward.f);
    const MatrixX size = at.problem.A.cwiseAbs();
    const double asked = kReturned * (at.c.norm() + (size * forward.f.cwiseAbs()).norm());
    const VectorX df = kinetic_energy_rounding(at, forward.v, forward.f);
    const double floor = kFloor * (size * df).norm();
    EXPECT_LE((inverse.c - at.c).norm(), asked + floor) << asked << " " << floor;
    if (floor > asked) ++floor_dominates;
  });
  EXPECT_EQ(unsolved, 0) << "trials" << trials;
  EXPECT_LE(floor_dominates, GetParam().floor_dominates * kTrials);
}

INSTANTIATE_TEST_SUITE_P(Range, KineticEnergyForwardInverse,
                         ::testing::Values(Range{"moderate", 1e-4, 1e-4, 0.2},
                                           Range{"whole", 1e-8, 1e-8, 0.7}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace counterpoint::contact::kinetic_energy_test
