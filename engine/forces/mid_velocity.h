// Velocity-dependent forces at the velocity in the middle of a step.
//
// In the semi-implicit scheme poses are half a step from velocities: w is that of the middle of the
// step before, w+ that of the middle of the step to come. Forces at q belong between the two. Taken
// at w alone, Coriolis, centrifugal and gyroscopic forces n(q, w) = B(w, w) add
//
//   h a' dT/dq [W],    a: acceleration by all that acts, T: kinetic energy
//
// to the energy of a linkage, in every step with the same sign; w' dT/dq changes sign.
// So of trees that have a prediction w + h a (velocity_predictor.h) they are taken as B(w, w + h
// a), which is n(q, w + h a / 2) less what is of second order in a: a tree at rest feels none.
// Impulses of closures must be part of a: they cancel most of what the forces alone would do.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

class MidVelocity {
 public:
  explicit MidVelocity(const Model& model) : V_(model.num_bodies()) {}

  /// Adds the mean force of B(w, other), where data.V is of w, to data.mean_force of a tree's
  /// bodies, or sets it where they have none; their c becomes zero. w, other (nv). Needs
  /// compute_poses, compute_velocities, compute_inertias.
  void add_force(const Model& model, const VectorRef& w, const VectorRef& other, const Tree& tree,
                 Data& data);

 private:
  std::vector<Motion> V_;  ///< of `other`
};

}  // namespace counterpoint
