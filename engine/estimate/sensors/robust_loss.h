// Robust losses for residuals that may be outliers.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint::estimation {

/// Loss summed over normalized residuals r: r^2 / 2; or with a scale c, Cauchy's c^2 / 2 log(1 +
/// r^2 / c^2), or the convex pseudo-Huber c^2 (sqrt(1 + r^2 / c^2) - 1).
struct RobustLoss {
  double scale = 0.0;  ///< c [standard deviations]; 0: squares
  bool convex = false;

  double cost(const VectorX& r) const {
    if (scale <= 0.0) return 0.5 * r.squaredNorm();
    const auto square = (r.array() / scale).square();
    if (convex) return scale * scale * ((1.0 + square).sqrt() - 1.0).sum();
    return 0.5 * scale * scale * square.log1p().sum();
  }
  /// Weights of iteratively reweighted least squares: rho' / r.
  VectorX weight(const VectorX& r) const {
    if (scale <= 0.0) return VectorX::Ones(r.size());
    const VectorX cauchy = (1.0 + (r.array() / scale).square()).inverse();
    return convex ? VectorX(cauchy.cwiseSqrt()) : cauchy;
  }
};

}  // namespace counterpoint::estimation
