// Derivatives of the smooth dynamics of an instant, without a step.
//
//   u = M(q) a + n(q, w) + joint forces(q, w) - wrenches - drag(q, w)
#pragma once

#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class SmoothDerivator {
 public:
  explicit SmoothDerivator(const Model& model);

  /// At the kinematics of (q, w) in ws.data, which are left as they are, a (nv) and wrenches.
  void compute(const Model& model, EffectSet effects, const VectorRef& w, const VectorRef& a,
               const std::vector<ExternalWrench>& wrenches, const Workspace::Impl& ws);

  MatrixX dq, dw;  ///< nv x nv: by a displacement at q, by w; bodies' forces alone
  MatrixX mass;    ///< nv x nv: M, and rotors
  /// nv: dampers, springs and servos, by the coordinate and by its velocity.
  VectorX stiffness, damping;

 private:
  TreeSweep sweep_;
  ForceResponses forces_;
  VectorX w_, zero_;
};

}  // namespace counterpoint
