// Standard deviations that a recording without contacts tells of itself.
#pragma once

#include <functional>
#include <vector>

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

/// Where laws of contacts and limits do nothing, and every coordinate is measured and has a motor,
/// any motion is possible, and only its smoothness tells errors from forces. Then the deviations of
/// positions (where `own_noise`, nv) are those of differences of high order, and those of changes
/// of forces are the most likely ones: in each round the sum of their squares over the degrees of
/// freedom that they take (restricted maximum likelihood; MacKay 1992, "Bayesian interpolation",
/// section 4). The sizes of forces no longer count. Changes weights of the problem of `fit`, and
/// carries `fit` to the motion they make most probable. Number of Newton steps.
int learn_deviations(const std::vector<char>& own_noise, const std::function<bool()>& stop,
                     MotionProblem& problem, MotionFit& fit);

/// Whether every coordinate is measured in most frames, and has a motor.
bool only_smoothness_tells(const MotionProblem& problem);

}  // namespace counterpoint::estimation
