// Derivatives of a step, of its inverse and forward, in the tangent space at q.
//
//   inverse   u  = u(q, v, v+)            what step_inverse recovers
//   forward   v+ = v+(q, v, u)            what step_forward leads to: u(q, v, v+) = u solved for v+
//
// A displacement dq (nv) of a configuration means q (+) dq, as integrate_configuration with h = 1
// moves it: along the joint's axes, rotations of quaternions in the axes of the body, as the
// velocities of the state are. docs/explanation/derivatives.md has formulas and says where they jump.
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint {

/// How derivatives are found.
enum class DerivativeMethod {
  kAnalytic,            ///< in closed form
  kCentralDifferences,  ///< of the whole step, O(difference step^2): the reference
  kExtrapolated,        ///< of two step sizes, extrapolated (Richardson): O(difference step^4)
};

/// Of step_inverse: applied force (rows, nv) by what it was recovered from (columns, nv).
struct InverseDerivatives {
  MatrixX dq;       ///< du/dq [N/m, N/rad, N m/m, N m/rad], dq a displacement at q
  MatrixX dv;       ///< du/dv [N s/m, ...]
  MatrixX dv_next;  ///< du/dv+ [N s/m, ...]; symmetric where all laws are convex
  /// dq and dv are by extrapolated differences of the whole step, though closed forms were asked
  /// for: something acts that has none (docs/explanation/derivatives.md).
  bool by_differences = false;
};

/// What a step at (q, v) that led to v_next under `known` recovers, into `out` as step_inverse
/// does, and its derivatives into `d`, which is sized here; nothing is allocated once sizes have
/// been seen. `known` stays as it is: wrenches (in world axes), servo targets and positions are
/// held. Where out.fault says that forces are not known, derivatives are NaN.
/// @param q_next  at the end: of implicit_midpoint with constraints, else not looked at and may be
/// null. It says which step; what is differentiated is u(q, v, v+), and q_next goes with these.
/// @param difference_step  of configurations [m, rad]; of velocities it is this over the time step,
/// at most 1e-4 m/s. 0: 1e-6, with constraints 1e-5 of their smoothing length, at least 1e-10.
/// Looked at by differences only.
/// @throws InputError where step_inverse does.
void step_inverse_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& out, InverseDerivatives& d,
                              DerivativeMethod method = DerivativeMethod::kAnalytic,
                              double difference_step = 0.0);  // Parameters: what it depends on, one by one
inline void step_inverse_derivatives(const Model& model, const SimulationOptions& options,
                                     VectorRef q, VectorRef v, VectorRef v_next, const Input& known,
                                     Workspace& workspace, Inverse& out, InverseDerivatives& d,
                                     DerivativeMethod method = DerivativeMethod::kAnalytic,
                                     double difference_step = 0.0) {  // Parameters: what it depends on, one by one
  step_inverse_derivatives(model, options, q, v, VectorX(), v_next, known, workspace, out, d,
                           method, difference_step);
}

/// Of step_forward: the state at the end by that at the start and the applied force, nv x nv each.
/// dq_next are displacements at the q_next of the step.
struct ForwardDerivatives {
  MatrixX dv_dq, dv_dv, dv_du;
  MatrixX dq_dq, dq_dv, dq_du;
  /// Beside h v_next the step displaces bodies (overlap_correction.h), and the above know it.
  bool displaces = false;
  MatrixX dq_dv_next;  ///< where it does: what of dq_next goes by v_next alone
};

/// Derivatives of the step from (q, v) under `known`, which led to v_next (and q_next, as above):
/// by one linear solve from those of the inverse, which are left in `inverse` and `d_inverse`.
/// known.applied_force is not looked at. Of runge_kutta_4, which has no inverse, by the chain rule
/// of its stages: v_next and `method` are not looked at then, forces of `inverse` and `d_inverse`
/// are NaN, and known.applied_force is what acted. False if du/dv+, or M, is singular: `d` is NaN
/// then.
/// @throws InputError where step_inverse, or the Runge-Kutta step, does.
bool step_forward_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& inverse, InverseDerivatives& d_inverse,
                              ForwardDerivatives& d,  // Parameters: what it depends on, one by one
                              DerivativeMethod method = DerivativeMethod::kAnalytic);
inline bool step_forward_derivatives(const Model& model, const SimulationOptions& options,
                                     VectorRef q, VectorRef v, VectorRef v_next, const Input& known,
                                     Workspace& workspace, Inverse& inverse,  // Parameters: all it depends on
                                     InverseDerivatives& d_inverse, ForwardDerivatives& d,
                                     DerivativeMethod method = DerivativeMethod::kAnalytic) {
  return step_forward_derivatives(model, options, q, v, VectorX(), v_next, known, workspace,
                                  inverse, d_inverse, d, method);
}

}  // namespace counterpoint
