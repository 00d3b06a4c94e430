// The implicit midpoint rule: second order, symmetric, with constraints.
//
//   smooth forces   M(q_m) a = n(q_m, w_m + p) + u - D w_m,    w_m = w + h a / 2
//                   q_m = q (+) (h / 2) (w_m + p)
//   impulses        (M(q) + h D) (w_c - w_m) = J' f(J w_c + b)
//                   q+ = q (+) h w_c,    w+ = w_c + h a / 2
//
// p: the change that closures and mimic joints will make to w_m, as far as (q, w) determines it
// (velocity_predictor.h). Forces at w_m alone would miss half of these impulses, and feed energy
// into or out of a linkage for ever.
//
// D: force of dampers, springs and servos per velocity, kd + h kp / 2. In both lines together these
// forces are taken at w_c, the mean velocity of the step: a servo that a contact holds still pulls
// with kp (q_t - q), however far it would have moved in free air.
//
// Without constraints w_c = w_m, and this is the implicit midpoint rule on the configuration
// manifold (Hairer, Lubich, Wanner 2006, II.1 and IV.8): order 2, no drift of the energy, exact for
// quadratic first integrals. Impulses act in the middle of the step, between two halves of the
// smooth motion, so contacts close gaps to the poses reached, as in the semi-implicit scheme; with
// them it is of first order. Velocities are those at the ends of steps: a body at rest on the
// ground shows -g h/2, half a step of falling, while its pose stands.
//
// The inverse: with w_m = w + w+ - w_c the second line is an equation for w_c alone,
//
//   2 (M(q) + h D) (w_c - (w + w+) / 2) = J' f(J w_c + b)
//
// This is a contact problem. Newton's method solves it in one or two steps from (q+ (-) q) / h,
// which equals w_c up to the rounding of poses. Then w_m, a, and u follow by one recursion. It
// needs q+ where there are constraints: q+ selects the solution, which Coulomb friction leaves
// open, and reveals q+ and w+ that belong to no single step.
#pragma once

#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Advances from the state of `step`, for which ws.start is prepared, to `next`. The status is
/// kNoProgress if the fixed-point iteration for w_m does not converge: bodies that turn by more
/// than about a radian a step.
void step_midpoint(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report);

/// Replaces w_c (nv), which was read off poses, by the solution for v and v_next, if a rounding of
/// poses up to `pose_rounding` [m, rad, 1] explains the difference; else returns false. In both
/// cases the linear velocities of free groups in w_c may be replaced. Reads ws.start and the laws
/// in ws.constraints; overwrites ws.solution, ws.midpoint.w_m, ws.motion.forces.diagonal,
/// ws.inverse.discarded and the inertias of ws.start.
bool refine_contact_velocity(const InverseArguments& step, double pose_rounding,
                             Workspace::Impl& ws, VectorX& w_c);

/// w_m from v, v_next and the impulses J' f, which are in ws.inverse.tau (nv): into `middle` (nv).
void find_middle(const InverseArguments& step, Workspace::Impl& ws, VectorX& middle);

/// Fills ws.stage with the kinematics and velocity-dependent forces at q_m and w_m + p, and
/// ws.motion.external with wrenches, losses of taut links and drag there; returns gravity [m/s^2].
/// w_m: nv. Also overwrites ws.midpoint.at_w and at_q.
Vector3 set_middle(const StepContext& at, const VectorRef& w_m,
                   const std::vector<ExternalWrench>& wrenches, Workspace::Impl& ws);

}  // namespace counterpoint
