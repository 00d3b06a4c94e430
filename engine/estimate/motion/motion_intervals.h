// Corrections of standard deviations, which a linearization underestimates in three cases: the
// contact law is still smooth, rows do not resolve the time of an impact within an interval, or the
// scene's laws do not hold in a row.
#pragma once

#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Adds the remaining effect of smoothing to the standard deviations of forces. The error of the
/// smooth law is proportional to the root of the smoothing, so the error left at the last stage is
/// the change since `softer` over (root of the ratio of smoothings - 1).
void widen_by_smoothing(const MotionProblem& problem, const ContinuationResult& found,
                        MotionEstimate& out);

/// Adds the effect of the unknown time of an impact within its interval to the standard deviations
/// of forces: a fraction of the change from a row to its neighbours.
void widen_by_timing(MotionEstimate& out);

/// Multiplies standard deviations by the root of the cost ratio, the largest of a row and its
/// neighbours, where it exceeds 1 (Birge, Phys. Rev. 40, 1932): the scene's laws do not hold there.
void widen_by_residuals(MotionEstimate& out);

}  // namespace counterpoint::estimation
