// Derivatives of the inverse of an implicit midpoint step (midpoint.h) without constraints.
//
// All is taken at w_m = (v + v+) / 2 and q_m = q (+) (h / 2) w_m, which moves by P dq + (h / 2) Q
// dw_m (P, Q: docs/explanation/derivatives.md). With T_q, T_w those of the smooth dynamics there,
// and K, D of the joints' springs, dampers and servos, which hold q + (h / 2) w_m and w_m,
//
//   W = T_w + (h / 2) T_q Q + D + (h / 2) K
//   du/dq = T_q P + K,    du/dv = W / 2 - M / h,    du/dv+ = W / 2 + M / h
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// After step_inverse with these arguments and `ws`, which found no constraints. `smooth` and `r`
/// (nv) are scratch.
void compute_midpoint_derivatives(const InverseArguments& of, const Workspace::Impl& ws,
                                  SmoothDerivator& smooth, VectorX& r, InverseDerivatives& d);

}  // namespace counterpoint
