// Velocity-dependent forces at the velocity in the middle of a step.
//
// In the semi-implicit scheme poses are half a step from velocities: w is the velocity in the
// middle of the previous step, w+ that in the middle of this one. Forces at q belong between the
// two. Evaluated at w, the Coriolis, centrifugal and gyroscopic forces n(q, w) = B(w, w) add energy
// to a linkage at the rate
//
//   h a' dT/dq [W],    a: acceleration by all forces, T: kinetic energy
//
// with the same sign in every step, whereas w' dT/dq changes sign. Therefore, for trees that have a
// prediction w + h a (velocity_predictor.h), they are evaluated as B(w, w + h a). This equals n(q,
// w + h a / 2) without the term of second order in a, so no such force acts on a tree at rest. a
// must include the impulses of closures, which cancel most of the effect of these forces.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

class MidVelocity {
 public:
  explicit MidVelocity(const Model& model) : V_(model.num_bodies()) {}

  /// Adds the mean force of B(w, other) to data.mean_force of a tree's bodies, or sets it if they
  /// have none; sets their c to zero. data.V belongs to w. w, other (nv). Needs compute_poses,
  /// compute_velocities, compute_inertias.
  void add_force(const Model& model, const VectorRef& w, const VectorRef& other, const Tree& tree,
                 Data& data);

 private:
  std::vector<Motion> V_;  ///< velocities of bodies at `other`
};

}  // namespace counterpoint
