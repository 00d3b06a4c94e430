// Derivatives of a Runge-Kutta step (runge_kutta.h), by the chain rule of its stages.
//
// Of stage s, with coordinates theta = c h theta' and velocities w = v + c h a of the stage before,
//
//   dq_s = P(theta) dq + Q(theta) dtheta
//   M da = du - (T_q + K) dq_s - (T_w + D) dw           (smooth_derivator.h)
//   dtheta' = (1 + [t] / 2 + [t]^2 / 12) dw - ([w] / 2 + ([t x w] + [t][w]) / 12) dt
//
// the last of rotations t, of angular velocity w; of other coordinates dtheta' = dw.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

namespace counterpoint {

class RungeKuttaDerivator {
 public:
  explicit RungeKuttaDerivator(const Model& model);

  /// Of the step from `start` under `input`. False if M is singular. @throws InputError where
  /// step_forward does.
  bool compute(const StepContext& start, const Input& input, Workspace::Impl& ws,
               SmoothDerivator& smooth, ForwardDerivatives& d);

  /// The state that the stages led to.
  const State& reached() const { return at_; }

 private:
  bool accelerate(const Model& model, const SmoothDerivator& smooth);

  SparseSolver solver_;
  State at_;
  VectorX theta_, rate_, acceleration_, theta_sum_, v_sum_;
  // nv x 3 nv: by q, v and u.
  MatrixX dtheta_, dq_, dw_, drate_, da_, dtheta_sum_, dv_sum_;
};

}  // namespace counterpoint
