// Contact forces of one step per pair of geometries, and their derivatives.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Sums the contacts of a step per pair, ordered by geometry; without standard deviations.
std::vector<ContactEstimate> pair_forces(const Model& model, const Inverse& inverse);

/// Pair forces of one frame.
struct PairForces {
  std::vector<ContactEstimate> pairs;
  MatrixX by_frames;      ///< 3 pairs x 3 nv: derivatives with respect to q_{t-1}, q_t, q_{t+1}
  MatrixX by_parameters;  ///< 3 pairs x parameters
};

/// Computes the forces of all frames at the point of a fit; derivatives are central differences.
std::vector<PairForces> differentiate_pair_forces(const MotionProblem& problem, MotionFit& fit);

}  // namespace counterpoint::estimation
