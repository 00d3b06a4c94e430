// Constant inverse masses of the default pose: they scale regularizer and smoothing of constraints.
#pragma once

#include <vector>

#include "counterpoint/engine/data.h"

namespace counterpoint {

/// Taken at the default pose once, never from the current mass matrix: the inverse of a step must
/// not need one (docs/concepts.md).
struct InverseWeights {
  std::vector<double>
      body;  ///< mean translational inverse inertia at the centre of mass [1/kg]; 0 for the world
  std::vector<double>
      rotational;  ///< mean rotational inverse inertia [1/(kg m^2)]; 0 for the world
  VectorX dof;     ///< diagonal of inv(M) [1/kg or 1/(kg m^2)]
};

/// O(bodies in a tree squared). @throws InputError naming the joint where inertia is not positive.
InverseWeights compute_inverse_weights(const Model& model, Data& data);

}  // namespace counterpoint
