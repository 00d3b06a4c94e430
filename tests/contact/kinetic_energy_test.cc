#include "counterpoint/contact/kinetic_energy.h"

#include <gtest/gtest.h>

#include "contact/random_problem.h"

namespace counterpoint::contact {
namespace {

using testing::Random;

KineticEnergyProblem random_case(Random& random, VectorX& c, int rank_share) {
  KineticEnergyProblem problem;
  const int n = random.integer(1, 6);
  const int rank = std::max(3, 3 * n / rank_share);
  MatrixX root(3 * n, rank);
  for (int i = 0; i < root.size(); ++i) root.data()[i] = random.signed_unit();
  problem.A = root * root.transpose();
  for (int i = 0; i < n; ++i) {
    problem.mu.push_back(random.uniform(0.1, 1.5));
    const double gap_speed = random.uniform(-0.2, 0.5);  // penetrating and separated
    problem.gap_speed.push_back(gap_speed);
    problem.regularizer.push_back(
        distant_regularizer(random.log_uniform(1e-4, 1e-2), gap_speed, 0.2));
  }
  problem.smoothing = problem.velocity_smoothing = random.log_uniform(1e-2, 1e-1);
  problem.continuation_speed = 0.1 * problem.velocity_smoothing;
  c.resize(3 * n);
  for (int i = 0; i < c.size(); ++i) c[i] = random.signed_unit();
  return problem;
}

TEST(KineticEnergy, InverseRecoversImpulsesAndFreeVelocity) {
  Random random(1);
  int solved = 0;
  for (int trial = 0; trial < 200; ++trial) {
    VectorX c;
    const KineticEnergyProblem problem = random_case(random, c, 1 + trial % 2);
    Settings settings;
    const KineticEnergyResult forward = solve_kinetic_energy(problem, c, settings);
    if (!succeeded(forward.status)) continue;
    ++solved;
    const KineticEnergyResult inverse = invert_kinetic_energy(problem, forward.v);
    // Round-off of v is amplified by q'' A = 1e4 A and by 1 / r <= 1e4.
    EXPECT_LT((inverse.f - forward.f).norm(), 1e-8 * forward.f.norm()) << trial;
    EXPECT_LT((inverse.c - c).norm(), 1e-8 * (c.norm() + problem.A.norm() * forward.f.norm()))
        << trial;
  }
  EXPECT_GE(solved, 195);  // 199: one runs into the iteration limit, and says so
}

TEST(KineticEnergy, ImpulsesLieInTheirCones) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    VectorX c;
    const KineticEnergyProblem problem = random_case(random, c, 2);
    const VectorX f = invert_kinetic_energy(problem, c).f;
    for (int i = 0; i < problem.num_contacts(); ++i) {
      EXPECT_LE(f.segment<2>(3 * i + 1).norm(), problem.mu[i] * f[3 * i] * (1 + 1e-14));
    }
  }
}

TEST(KineticEnergy, NotANumberIsReported) {
  KineticEnergyProblem problem;
  problem.A = MatrixX::Identity(3, 3);
  problem.mu = {0.5};
  problem.gap_speed = {0.0};
  problem.regularizer = {1e-3};
  VectorX c = VectorX::Constant(3, std::nan(""));
  EXPECT_EQ(solve_kinetic_energy(problem, c, Settings{}).status, Status::kNotFinite);
}

}  // namespace
}  // namespace counterpoint::contact
