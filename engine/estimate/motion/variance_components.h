// Standard deviations that nobody gave, from the estimate itself.
#pragma once

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

/// Mean squares by coordinate (nv) that are expected of each kind of residual, given all the data:
/// squares of the estimate and variances (the step of expectation maximization: Dempster, Laird and
/// Rubin, "Maximum likelihood from incomplete data via the EM algorithm", 1977).
struct VarianceComponents {
  VectorX position, acceleration, size, change;
};

/// At the point of a fit. Parameters count as known.
VarianceComponents variance_components(const MotionProblem& problem, MotionFit& fit);

}  // namespace counterpoint::estimation
