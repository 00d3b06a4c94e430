// Derivatives of the smooth dynamics at one instant, without a step.
//
//   u = M(q) a + n(q, w) + joint forces(q, w) - wrenches - drag(q, w)
#pragma once

#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {

class SmoothDerivator {
 public:
  explicit SmoothDerivator(const Model& model);

  /// Computes the derivatives at a (nv) and these wrenches. inverted.at() has the kinematics of (q,
  /// w), which are left unchanged.
  void compute(const Model& model, EffectSet effects, const VectorRef& w, const VectorRef& a,
               const std::vector<ExternalWrench>& wrenches, const StageMotion& stage,
               const VectorX& rotors);

  MatrixX dq, dw;  ///< nv x nv: by a displacement at q and by w, without joint forces
  MatrixX mass;    ///< nv x nv: M with rotor inertia
  /// Dampers, springs and servos (nv): derivatives by their coordinate and by its velocity.
  VectorX stiffness, damping;

 private:
  TreeSweep sweep_;
  ForceResponses forces_;
  VectorX w_, zero_;
};

}  // namespace counterpoint
