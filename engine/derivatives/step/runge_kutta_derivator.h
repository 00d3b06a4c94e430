// Derivatives of a Runge-Kutta step (runge_kutta.h), by the chain rule over its stages.
//
// Stage s has coordinates theta = c h theta' and velocities w = v + c h a, with theta' and a of the
// stage before, and
//
//   dq_s = P(theta) dq + Q(theta) dtheta
//   M da = du - (T_q + K) dq_s - (T_w + D) dw           (smooth_derivator.h)
//   dtheta' = (1 + [t] / 2 + [t]^2 / 12) dw - ([w] / 2 + ([t x w] + [t][w]) / 12) dt
//
// where the last line is for rotations t of angular velocity w; other coordinates: dtheta' = dw.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

namespace counterpoint {

class RungeKuttaDerivator {
 public:
  explicit RungeKuttaDerivator(const Model& model);

  /// Computes the derivatives of the step from `start` under `input`. Returns false if M is
  /// singular.
  /// @throws InputError where step_forward does, and with closures or mimic joints.
  bool compute(const StepContext& start, const Input& input, Workspace::Impl& ws,
               SmoothDerivator& smooth, ForwardDerivatives& d);

  /// The state after the step.
  const State& reached() const { return at_; }

 private:
  bool accelerate(const Model& model, const SmoothDerivator& smooth);

  SparseSolver solver_;
  State at_;
  VectorX theta_, rate_, acceleration_, theta_sum_, v_sum_;
  // Derivatives by q, v and u, nv x 3 nv.
  MatrixX dtheta_, dq_, dw_, drate_, da_, dtheta_sum_, dv_sum_;
};

}  // namespace counterpoint
