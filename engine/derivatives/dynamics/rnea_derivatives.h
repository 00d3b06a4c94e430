// Derivatives of inverse dynamics, by one backward pass (sweep.h).
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/dynamics.h"

namespace counterpoint {

/// Scratch of one thread for one model.
class RneaDerivator {
 public:
  explicit RneaDerivator(const Model& model);

  /// At the poses and inertias in `data`, v (nv) [m/s, rad/s], a (nv), gravity [m/s^2]. External
  /// wrenches as in rnea, from data.external if data.has_external: they keep their axes, those of
  /// W, and go with the body's origin. Velocity-dependent forces as data.has_coriolis says, mean
  /// forces are not looked at. Needs compute_poses, compute_inertias. Nothing is allocated once
  /// `out` has its size.
  void compute(const Model& model, const VectorRef& v, const VectorRef& a, const Vector3& gravity,
               const Kinematics& data, RneaDerivatives& out);

 private:
  TreeSweep sweep_;
  std::vector<BodyResponse> responses_;  ///< by body, of wrenches
  std::vector<char> responds_;
  VectorX zero_;
};

}  // namespace counterpoint
