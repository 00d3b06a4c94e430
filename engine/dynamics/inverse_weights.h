// Constant inverse masses in the default pose, which scale regularizer and smoothing of
// constraints.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Whether a body moves with prescribed joints only (JointInfo::prescribed), or not at all, so that
/// no force moves it. True for the world.
bool is_driven(const Model& model, int body);

/// Inertia [kg, kg m^2] of a prescribed joint: its acceleration is what its force says, to the last
/// bit, beside any other inertia and force.
inline constexpr double kLockedInertia = 1e30;

/// Inverse mass for the relative motion of a closure's anchors.
struct ClosureWeight {
  double linear = 0.0;   ///< mean over directions [1/kg]
  double angular = 0.0;  ///< mean over axes [1/(kg m^2)]
};

/// Computed once in the default pose, never from the current mass matrix, since the inverse of a
/// step must not need one (docs/explanation/concepts.md).
struct InverseWeights {
  /// Inverse mass at the contacts of each body [1/kg], 0 for the world and for driven bodies, with
  /// prescribed joints as they are: the larger of the mean over
  /// directions at the centre of mass and a fraction of the rotational part where the body's
  /// geometry makes it largest.
  std::vector<double> contact;
  std::vector<ClosureWeight> closure;  ///< per closure of Model::closures
  VectorX dof;                         ///< diagonal of inv(M) [1/kg or 1/(kg m^2)]
  std::vector<double> tendon;          ///< per tendon (tendon_weight)
};

/// Returns the inverse mass that a tendon moves [1/kg]: the sum over the joints of a fixed one, of
/// coefficient^2 times `dof`; over the bodies of a spatial one, of `contact` (their entries above).
double tendon_weight(const Tendon& tendon, const Model& model, const std::vector<double>& contact,
                     const VectorX& dof);

/// Computes the weights, O(bodies in a tree squared). @throws InputError naming the joint whose
/// inertia is not positive, or the closure whose anchors cannot move.
InverseWeights compute_inverse_weights(const Model& model, Data& data);

}  // namespace counterpoint
