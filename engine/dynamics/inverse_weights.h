// Constant inverse masses of the default pose: they scale regularizer and smoothing of constraints.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Of the relative motion that a closure holds, at its anchors.
struct ClosureWeight {
  double linear = 0.0;   ///< mean over directions [1/kg]
  double angular = 0.0;  ///< mean over axes [1/(kg m^2)]
};

/// Taken at the default pose once, never from the current mass matrix: the inverse of a step must
/// not need one (docs/explanation/concepts.md).
struct InverseWeights {
  /// Inverse mass that a contact on a body feels [1/kg], 0 for the world: the larger of that of its
  /// centre of mass, mean over directions, and a share of what rotation adds where the body's
  /// geometry feels it most.
  std::vector<double> contact;
  std::vector<ClosureWeight> closure;  ///< of Model::closures
  VectorX dof;                         ///< diagonal of inv(M) [1/kg or 1/(kg m^2)]
};

/// O(bodies in a tree squared). @throws InputError naming the joint where inertia is not positive.
InverseWeights compute_inverse_weights(const Model& model, Data& data);

}  // namespace counterpoint
