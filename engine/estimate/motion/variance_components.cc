#include "counterpoint/engine/estimate/motion/variance_components.h"

#include <cmath>

#include "counterpoint/engine/estimate/motion/frame_covariance.h"

namespace counterpoint::estimation {
namespace {

VectorX diagonal_of(const MatrixX& J, const MatrixX& covariance) {
  return (J * covariance).cwiseProduct(J).rowwise().sum();
}

/// Mean squares of one frame.
struct FrameSquares {
  VectorX position, position_weight, acceleration, size, change;
};

}  // namespace

VarianceComponents variance_components(const MotionProblem& problem, MotionFit& fit) {
  const int nv = problem.nv(), frames = problem.frames();
  const FrameCovariance covariances(fit.linearized().band());
  const std::vector<VectorX>& q = fit.point().q;
  std::vector<FrameSquares> squares(static_cast<std::size_t>(frames));
  fit.pool().run(frames, [&](int t, int) {
    if (t == 0 || t == frames - 1) return;
    const auto i = static_cast<std::size_t>(t);
    FrameSquares& out = squares[i];
    const int count = t > 1 ? 4 : 3, first = t + 2 - count;
    const MatrixX all = covariances.of(first, count);
    const MatrixX three = all.bottomRightCorner(3 * nv, 3 * nv);
    VectorX before(nv), behind(nv), off(nv);
    configuration_difference(problem.model, problem.measured[i], q[i], off);
    out.position_weight.setOnes(nv);
    for (int k = 0; k < nv; ++k) {
      const double ratio = off[k] * problem.position_weight(k, t) / problem.outlier;
      out.position_weight[k] = 1.0 / (1.0 + ratio * ratio);
    }
    out.position = out.position_weight.cwiseProduct(off.cwiseAbs2()) +
                   three.diagonal().segment(nv, nv);
    // Accelerations as differences of coordinates: turns of neighbouring frames are small.
    configuration_difference(problem.model, q[i - 1], q[i], before);
    configuration_difference(problem.model, q[i], q[i + 1], behind);
    const double h2 = problem.h() * problem.h();
    MatrixX A = MatrixX::Zero(nv, 3 * nv);
    for (int k = 0; k < nv; ++k) {
      A(k, k) = A(k, 2 * nv + k) = 1.0 / h2;
      A(k, nv + k) = -2.0 / h2;
    }
    out.acceleration = ((behind - before) / h2 - problem.acceleration.col(t)).cwiseAbs2() +
                       diagonal_of(A, three);
    const Instant& at = fit.instants()[i];
    out.size = at.force.cwiseAbs2() + diagonal_of(at.by_frames, three);
    if (t < 2) return;
    const Instant& last = fit.instants()[i - 1];
    MatrixX D = MatrixX::Zero(nv, 4 * nv);
    D.leftCols(3 * nv) = -last.by_frames;
    D.rightCols(3 * nv) += at.by_frames;
    out.change = (at.force - last.force).cwiseAbs2() + diagonal_of(D, all);
  });
  VarianceComponents sums{VectorX::Zero(nv), VectorX::Zero(nv), VectorX::Zero(nv),
                          VectorX::Zero(nv)};
  for (int t = 1; t + 1 < frames; ++t) {
    const FrameSquares& one = squares[static_cast<std::size_t>(t)];
    sums.position += one.position / (frames - 2);
    sums.acceleration += one.acceleration / (frames - 2);
    sums.size += one.size / (frames - 2);
    if (t > 1) sums.change += one.change / (frames - 3);
  }
  return sums;
}

}  // namespace counterpoint::estimation
