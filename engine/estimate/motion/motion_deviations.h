// Standard deviations estimated from a recording without contacts.
#pragma once

#include <functional>
#include <vector>

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

/// Learns standard deviations from the recording itself, for motions without active contacts or
/// limits in which every coordinate is measured and has a motor: any motion is then possible, and
/// only its smoothness separates errors from forces. Position deviations (where `own_noise`, nv)
/// come from high-order differences. Deviations of force changes are the most likely ones: each
/// round divides their sum of squares by their effective number of degrees of freedom (restricted
/// maximum likelihood; MacKay 1992, "Bayesian interpolation", section 4). The prior on force
/// magnitudes is dropped. Changes the weights of the problem of `fit`, and moves `fit` to the most
/// probable motion. Returns the number of Newton steps.
int learn_deviations(const std::vector<char>& own_noise, const std::function<bool()>& stop,
                     MotionProblem& problem, MotionFit& fit);

/// Returns whether every coordinate has a motor and is measured in most frames, and neither forces,
/// accelerations nor parameters are in the problem.
bool only_smoothness_tells(const MotionProblem& problem);

}  // namespace counterpoint::estimation
