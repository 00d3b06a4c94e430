// Contact forces of one step by pairs of geometries, and how they go with the motion.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Contacts of a step by pairs, in the order of their geometries; without deviations.
std::vector<ContactEstimate> pair_forces(const Model& model, const Inverse& inverse);

/// Forces of one frame.
struct PairForces {
  std::vector<ContactEstimate> pairs;
  MatrixX by_frames;      ///< 3 pairs x 3 nv: derivatives by q_{t-1}, q_t, q_{t+1}
  MatrixX by_parameters;  ///< 3 pairs x parameters
};

/// Forces of all frames, at the point of a fit; derivatives are central differences.
std::vector<PairForces> differentiate_pair_forces(const MotionProblem& problem, MotionFit& fit);

}  // namespace counterpoint::estimation
