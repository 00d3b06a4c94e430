// Derivatives of inverse dynamics, by one backward sweep (sweep.h).
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/dynamics.h"

namespace counterpoint {

/// Differentiates inverse dynamics. Scratch memory inside: one object per thread and model.
class RneaDerivator {
 public:
  explicit RneaDerivator(const Model& model);

  /// Computes the derivatives at the poses and inertias in `data`, v (nv) [m/s, rad/s], a (nv)
  /// [m/s^2, rad/s^2] and gravity [m/s^2]. External wrenches are data.external if
  /// data.has_external, as in rnea: they keep their world axes and act at the body's origin.
  /// Velocity-dependent forces are included if data.has_coriolis; mean forces are ignored. Needs
  /// compute_poses, compute_inertias. Nothing is allocated once `out` has its size.
  void compute(const Model& model, const VectorRef& v, const VectorRef& a, const Vector3& gravity,
               const Data& data, RneaDerivatives& out);

 private:
  TreeSweep sweep_;
  std::vector<BodyResponse> responses_;  ///< per body, for its external wrench
  std::vector<char> responds_;
  VectorX zero_;
};

}  // namespace counterpoint
