// One step forward, and its exact discrete inverse.
//
//   M (w+ - w) = h (n(q, w) + u - D w+) + J' f(J w+ + b),      q+ = q (+) h w+
//
// Semi-implicit Euler; joint damping D is implicit. The inverse reads u off the same equation. A
// step runs the effects that the model calls for and options.effects leaves on (effects.h), and no
// others.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/collision/candidate.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/fault.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Scratch of one thread for one model: created once, grown while sizes are new, then reused.
/// Deleting it loses nothing.
class Workspace {
 public:
  explicit Workspace(const Model& model);
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

  /// How often the code of each effect has run, in steps and inverses with this workspace.
  const EffectCounts& effect_counts() const;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

struct StepReport {
  contact::Status status = contact::Status::kConverged;
  int contacts = 0;         ///< contact candidates given to the solver
  int constraint_rows = 0;  ///< of contacts, closures, limits, dry friction and mimics
  int newton_iterations = 0;
  double residual = 0.0;       ///< relative, see contact::Settings::tolerance
  double max_penetration = 0;  ///< at the start of the step [m], 0 if nothing overlaps
  int sleeping_bodies = 0;     ///< left out: nothing moves there (sleep.h)
  /// Laws softer than their own, where the step could not be solved otherwise (softening.h).
  Softening softening;
  /// What is wrong, if the step did not succeed; if it did, the closure or mimic joint of which
  /// Simulator sees that it stays open.
  Fault fault;
  bool succeeded() const { return contact::succeeded(status); }
};

/// Advances `state` by options.time_step [s] under `input`. On failure (report.succeeded() is
/// false) report.fault says what is wrong, and `next` must not be trusted. @throws InputError where
/// the sizes are not the model's, or the time step is not positive.
StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace, State& next);  // Parameters: what it depends on, one by one

/// One contact as the inverse (or the last forward step) saw it.
struct ContactForce {
  collision::Candidate contact;
  Vector3 force = Vector3::Zero();  ///< mean over the step, on geometry B, in W [N]
  /// Of B over A at the end of the step, across the normal, in W [m/s].
  Vector3 slip = Vector3::Zero();
};

/// What a constraint on joint coordinates did: a limit, a velocity limit, dry friction, a mimic
/// joint. (Servos: Inverse::servo_force.)
struct JointForce {
  Effect effect = Effect::kLimits;
  int v_index = 0;     ///< the coordinate of v that it acts on; of a mimic joint the follower's
  double force = 0.0;  ///< mean over the step, in the coordinate's direction [N or N m]
};

/// What a closure did, as the inverse saw it.
struct ClosureForce {
  Vector3 position = Vector3::Zero();  ///< halfway between the anchors, in W [m]
  Force force;                         ///< mean over the step, on body B, in W, there [N, N m]
};

/// What was at work between (q, v) and v_next.
struct Inverse {
  /// What is wrong with what was given: forces are NaN then; or which force came out not finite.
  Fault fault;
  VectorX applied_force;  ///< nv: u [N, N m]
  VectorX contact_force;  ///< nv: J' f / h of all constraints [N, N m]
  double force_scale =
      0.0;  ///< largest of |inertial + bias|, |applied|, |contact| over the coordinates [N or N m]
  std::vector<ContactForce> contacts;
  std::vector<ClosureForce> closures;  ///< of Model::closures
  std::vector<JointForce> joints;      ///< of joints that a limit, friction or another joint holds
  /// By Model::servos: what the servo asked for at v_next [N, N m]. With the applied force it makes
  /// what the motor gave, which is no more than its effort limit.
  VectorX servo_force;
};

/// Recovers the applied force from (q, v) at the start and v_next at the end of a step. Needs no
/// optimization, no mass matrix: O(bodies + contacts), but for linkages with closures, whose
/// velocity-dependent forces take a linear solve (velocity_predictor.h). All sizes as in State. `known`: what
/// is known of the input, wrenches and servo targets (its applied force is not used); without it
/// there are no wrenches, and the targets are the model's. Where a motor was at its effort limit
/// the force recovered is the one on the limit (servos.h, effort_limits.h). q_next: coordinates at
/// the end, needed by implicit_midpoint where there are constraints, else not looked at and may be
/// null. @throws InputError for an integrator without inverse.
void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef q_next, VectorRef v_next, const Input& known, Workspace& workspace,
                  Inverse& out);  // Parameters: what it depends on, one by one
inline void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q,
                         VectorRef v, VectorRef v_next, const Input& known, Workspace& workspace,
                         Inverse& out) {  // Parameters: what it depends on, one by one
  step_inverse(model, options, q, v, VectorX(), v_next, known, workspace, out);
}
inline void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q,
                         VectorRef v, VectorRef v_next, Workspace& workspace, Inverse& out) {
  step_inverse(model, options, q, v, v_next, Input(), workspace, out);
}

}  // namespace counterpoint
