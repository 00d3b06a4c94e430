// Standard deviations from a linearization are too small in three cases, and are widened here: the
// contact law is still smooth, rows do not tell the moment of an impact within its interval, or the
// scene's laws do not hold in a row.
#pragma once

#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Adds to the standard deviations of forces what the smoothing of the contact law still does to
/// them: the law differs from the hard one by the root of the smoothing, so what is left at the
/// last stage is the change since `softer` over (root of the smoothings' ratio - 1).
void widen_by_smoothing(const MotionProblem& problem, const ContinuationResult& found,
                        MotionEstimate& out);

/// Adds to the standard deviations of forces what an impact's moment within its interval, which
/// rows do not tell, does to them: a share of the change from a row to its neighbours.
void widen_by_timing(MotionEstimate& out);

/// Widens standard deviations by the square root of the cost ratio, the largest of a row and its
/// neighbours, where it exceeds 1 (Birge, Phys. Rev. 40, 1932): the scene's laws do not hold there.
void widen_by_residuals(MotionEstimate& out);

}  // namespace counterpoint::estimation
