// Derivatives of the inverse of an implicit midpoint step (midpoint.h) without constraints.
//
// All terms are taken at the midpoint, with P and Q of docs/explanation/derivatives.md:
//
//   w_m = (v + v+) / 2,    q_m = q (+) (h / 2) w_m,    dq_m = P dq + (h / 2) Q dw_m
//
// With T_q, T_w the derivatives of the smooth dynamics there, and K, D those of springs, dampers
// and servos, whose coordinate is q + (h / 2) w_m and whose velocity is w_m,
//
//   W = T_w + (h / 2) T_q Q + D + (h / 2) K
//   du/dq = T_q P + K,    du/dv = W / 2 - M / h,    du/dv+ = W / 2 + M / h
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

namespace counterpoint {

/// Computes d of an inverse step that found no constraints.
/// `smooth` and `r` (nv) are scratch.
void compute_midpoint_derivatives(const InverseArguments& of, const InvertedStep& inverted,
                                  SmoothDerivator& smooth, VectorX& r, InverseDerivatives& d);

}  // namespace counterpoint
