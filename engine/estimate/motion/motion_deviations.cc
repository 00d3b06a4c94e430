#include "counterpoint/engine/estimate/motion/motion_deviations.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/motion/frame_covariance.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"

namespace counterpoint::estimation {
namespace {

constexpr int kMostRounds = 30;
/// Rounds end when no deviation changes by more than this fraction.
constexpr double kSettled = 0.05;
/// Order of the differences that estimate the noise.
constexpr int kOrder = 6;
/// Lower bound of the noise [m, rad]; interpolated recordings seem to have none.
constexpr double kLeastOwnNoise = 1e-7;
/// Largest factor by which a round changes a deviation.
constexpr double kMostFactor = 30.0;
/// Lower bound of the effective degrees of freedom of force changes, as a fraction of their number.
constexpr double kLeastShare = 1e-4;
/// Newton steps of a round, and their tolerance (relative decrease of the cost).
constexpr int kSteps = 5;
constexpr double kTolerance = 1e-3;

/// Sums over the frames of squared force changes and of their posterior variances, by coordinate.
struct Changes {
  VectorX square, variance;
};

VectorX variances(const MatrixX& J, const MatrixX& covariance) {
  return (J * covariance).cwiseProduct(J).rowwise().sum();
}

/// Computes the sums over the changes at instants 2 ... N - 1.
Changes changes(const MotionProblem& problem, MotionFit& fit) {
  const int nv = problem.nv(), last = problem.frames() - 1;
  const FrameCovariance covariances(fit.linearized().band());
  MatrixX square = MatrixX::Zero(nv, problem.frames()), variance = square;
  fit.pool().run(problem.frames(), [&](int t, int) {
    if (t < 2 || t >= last) return;
    const auto i = static_cast<std::size_t>(t);
    const Instant &before = fit.instants()[i - 1], &at = fit.instants()[i];
    MatrixX J = MatrixX::Zero(nv, 4 * nv);
    J.leftCols(3 * nv) = -before.by_frames;
    J.rightCols(3 * nv) += at.by_frames;
    square.col(t) = (at.force - before.force).cwiseAbs2();
    variance.col(t) = variances(J, covariances.of(t - 2, 4));
  });
  return {square.rowwise().sum(), variance.rowwise().sum()};
}

/// Returns the new weight of the force change of one coordinate; `weight` is the current one.
double next_weight(double weight, double square, double variance, int count) {
  if (!(square > 0.0)) return weight;
  const double taken = std::max(count - variance * weight * weight, kLeastShare * count);
  return std::clamp(std::sqrt(taken / square), weight / kMostFactor, weight * kMostFactor);
}

void set_noise(const std::vector<char>& own_noise, MotionProblem& problem) {
  const VectorX noise =
      white_noise(problem.model, problem.measured, kOrder).cwiseMax(kLeastOwnNoise);
  for (int i = 0; i < problem.nv(); ++i)
    if (own_noise[static_cast<std::size_t>(i)] != 0)
      problem.position_weight.row(i) = problem.position_weight.row(i).cwiseSign() / noise[i];
}

}  // namespace

bool only_smoothness_tells(const MotionProblem& problem) {
  const VectorX measured = problem.position_weight.cwiseSign().rowwise().mean();
  return problem.change_weight.minCoeff() > 0.0 && measured.minCoeff() > 0.5 &&
         problem.parameters.empty() && problem.force_weight.isZero(0.0) &&
         problem.acceleration_weight.isZero(0.0);
}

int learn_deviations(const std::vector<char>& own_noise, const std::function<bool()>& stop,
                     MotionProblem& problem, MotionFit& fit) {
  problem.size_weight.setZero();
  set_noise(own_noise, problem);
  fit.begin(fit.options(), MotionPoint(fit.point()));
  int steps = fit.minimize(kSteps, kTolerance, stop);
  for (int round = 0; round < kMostRounds && !(stop && stop()); ++round) {
    const Changes now = changes(problem, fit);
    const VectorX before = problem.change_weight;
    for (int i = 0; i < problem.nv(); ++i)
      problem.change_weight[i] =
          next_weight(before[i], now.square[i], now.variance[i], problem.frames() - 3);
    fit.begin(fit.options(), MotionPoint(fit.point()));
    steps += fit.minimize(kSteps, kTolerance, stop);
    const VectorX factor = problem.change_weight.cwiseQuotient(before);
    if (factor.maxCoeff() < 1.0 + kSettled && factor.minCoeff() > 1.0 - kSettled) break;
  }
  return steps;
}

}  // namespace counterpoint::estimation
