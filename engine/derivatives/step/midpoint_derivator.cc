#include "counterpoint/engine/derivatives/step/midpoint_derivator.h"

#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"

namespace counterpoint {

void compute_midpoint_derivatives(const InverseArguments& of, const InvertedStep& inverted,
                                  SmoothDerivator& smooth, VectorX& r, InverseDerivatives& d) {
  const Model& model = of.model;
  const double h = of.h();
  r = (of.v_next - of.v) / h;
  const VectorX& w_m = inverted.midpoint.w_m;
  smooth.compute(model, of.effects, w_m, r, of.known.wrenches, inverted.stage,
                 inverted.start.rotor_inertia(model, of.effects));
  r = 0.5 * h * w_m;
  d.dq = smooth.dq;
  multiply_columns(model, RotationMap::kP, r, d.dq);
  d.dq.diagonal() += smooth.stiffness;
  multiply_columns(model, RotationMap::kQ, r, smooth.dq);
  d.dv = 0.5 * smooth.dw + 0.25 * h * smooth.dq;
  d.dv.diagonal() += 0.5 * smooth.damping + 0.25 * h * smooth.stiffness;
  d.dv_next = d.dv + smooth.mass / h;
  d.dv -= smooth.mass / h;
}

}  // namespace counterpoint
