// One step forward, and its exact discrete inverse.
//
//   M (w+ - w) = h (n(q, w) + u - D w+) + J' f(J w+ + b),      q+ = q (+) h w+
//
// This is the semi-implicit Euler step, with implicit joint damping D; the inverse solves the same
// equation for u. docs/explanation/integrators.md has the other integrators. A step runs the
// effects that the model calls for and options.effects leaves on, and no others.
#pragma once

#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/fault.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/workspace.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Result of a step.
struct StepReport {
  contact::Status status = contact::Status::kConverged;
  int contacts = 0;         ///< contact candidates given to the solver
  int constraint_rows = 0;  ///< rows of contacts, closures, limits, dry friction and mimics
  int newton_iterations = 0;
  double residual = 0.0;       ///< relative, see contact::Settings::tolerance [-]
  double max_penetration = 0;  ///< at the start of the step [m], 0 if nothing overlaps
  int sleeping_bodies = 0;     ///< bodies left out of the step (sleep.h)
  /// Softening of the contact laws, where the step could not be solved otherwise (softening.h), or
  /// the mark of an unfinished step.
  Softening softening;
  int taut_links = 0;            ///< links with more rotational inertia in the step (taut_links.h)
  double largest_inertia = 1.0;  ///< largest factor of their inertia [-]
  /// The fault of a step that did not succeed. In a step that did, a closure or mimic joint that
  /// Simulator finds to stay open.
  Fault fault;
  bool succeeded() const { return contact::succeeded(status); }
};

/// A failed step: its number, counted from 0, and the time of its start [s].
struct FailedStep {
  long step = 0;
  double time = 0.0;
  StepReport report;
};

/// Advances `state` by options.time_step [s] under `input`, into `next`. On failure
/// (report.succeeded() is false) report.fault has the reason and `next` is not valid. @throws
/// InputError where the sizes are not the model's, or the time step is not positive.
StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace, State& next);

/// A contact of a step.
struct ContactForce {
  collision::Candidate contact;
  Vector3 force = Vector3::Zero();  ///< mean over the step, on geometry B, in W [N]
  /// Torque of spinning and rolling friction, on geometry B at the contact's position, in W [N m].
  Vector3 torque = Vector3::Zero();
  /// Velocity of B relative to A at the end of the step, across the normal, in W [m/s].
  Vector3 slip = Vector3::Zero();
};

/// Force of a constraint on joint coordinates: a limit, a velocity limit, dry friction, a mimic
/// joint. Inverse::servo_force has those of servos.
struct JointForce {
  Effect effect = Effect::kLimits;
  int v_index = 0;     ///< coordinate of v that it acts on; for a mimic joint the follower's
  double force = 0.0;  ///< mean over the step, in the coordinate's direction [N or N m]
};

/// Force of a closure.
struct ClosureForce {
  Vector3 position = Vector3::Zero();  ///< where it acts (closures.h), in W [m]
  Force force;                         ///< mean over the step, on body B, in W, there [N, N m]
};

/// The forces that acted between (q, v) and v_next.
struct Inverse {
  /// The invalid argument (the forces are NaN then), or the force that is not finite.
  Fault fault;
  VectorX applied_force;  ///< nv: u [N, N m]
  VectorX contact_force;  ///< nv: J' f / h of all constraints [N, N m]
  double force_scale =
      0.0;  ///< largest of |inertial + bias|, |applied|, |contact| over the coordinates [N or N m]
  std::vector<ContactForce> contacts;
  std::vector<ClosureForce> closures;  ///< in the order of Model::closures
  std::vector<JointForce> joints;      ///< joints held by a limit, friction or another joint
  /// Per tendon (Model::tendons): force of its spring, damper, friction, limits, servo and input
  /// together, mean over the step [N]; it is part of contact_force.
  VectorX tendon_force;
  /// Per actuator (Model::actuators): its force F, mean over the step [N, N m]. On joints and
  /// tendons it is part of contact_force, else it acts as a known wrench.
  VectorX actuator_force;
  /// Wrenches by which actuators on links and adhesion acted, beside those of the input.
  std::vector<ExternalWrench> actuator_wrenches;
  VectorX z_next;  ///< internal states at the end of the step (nz)
  /// Per servo (Model::servos): force that the servo demands at v_next [N, N m]. Its sum with the
  /// applied force is the force of the motor, within its effort limit.
  VectorX servo_force;
};

/// Returns the sum of the contact forces of an inverse on a body, in W [N].
Vector3 contact_force_on(const Model& model, const Inverse& inverse, int body);

/// Recovers the applied force from (q, v) at the start and v_next at the end of a step. It takes no
/// optimization and no mass matrix: O(bodies + contacts), except for linkages with closures, whose
/// velocity-dependent forces take a linear solve (velocity_predictor.h). All sizes as in State.
///
/// known: the known part of the input, wrenches and servo targets; its applied force is not used.
/// Without it there are no wrenches, and the targets are the model's. Where a motor was at its
/// effort limit, the recovered force is the one on the limit (limit_applied_forces). q_next:
/// coordinates at the end, which implicit_midpoint needs where there are constraints; else it may
/// be empty. @throws InputError for an integrator without inverse.
void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef q_next, VectorRef v_next, const Input& known, Workspace& workspace,
                  Inverse& out);
inline void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q,
                         VectorRef v, VectorRef v_next, const Input& known, Workspace& workspace,
                         Inverse& out) {
  step_inverse(model, options, q, v, VectorX(), v_next, known, workspace, out);
}
inline void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q,
                         VectorRef v, VectorRef v_next, Workspace& workspace, Inverse& out) {
  step_inverse(model, options, q, v, v_next, Input(), workspace, out);
}

}  // namespace counterpoint
