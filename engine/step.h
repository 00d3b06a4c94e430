// One step forward, and its exact discrete inverse.
//
//   M (w+ - w) = h (n(q, w) + u - D w+) + J' f(J w+ + b),      q+ = q (+) h w+
//
// Semi-implicit Euler; joint damping D is implicit. The inverse reads u off the same equation. A
// step runs the effects that the model calls for and options.effects leaves on, and no others.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

// ---- Which effects a scene calls for, and why: determined once; a step runs these and no others.

/// The effects that something in the model calls for: damping where a joint has some, contacts
/// where a pair of geometries may touch, and so on. What an input calls for (applied forces,
/// wrenches) is in.
EffectSet called_for(const Model& model, const collision::Collider& collider);

/// Those of `called` that `switches` leaves on. Without contacts there is no friction, and so on.
EffectSet active_effects(EffectSet called, EffectSet switches);

/// Links that closures and joints may pull, and light enough for what may hang there to turn them
/// fast (taut_links.h): the bodies, ascending.
std::vector<int> list_pulled_links(const Model& model);

/// One line of the table of effects.
struct EffectUse {
  Effect effect = Effect::kGravity;
  bool called_for = false;  ///< something in the scene asks for it
  bool on = false;          ///< called for and not switched off: it is run
  std::string why;          ///< what calls for it; or who switched it off
  int rows = 0;  ///< rows of the contact problem it can add; of contacts: at each contact point
};

/// All effects, in the order of the enumeration. For reading; it allocates.
std::vector<EffectUse> list_effects(const Model& model, const collision::Collider& collider,
                                    const SimulationOptions& options);

// ---- Why a step failed: the kind of fault, the body, joint, contact, closure or coordinate at
// fault, how large it is, and what a user can do.

enum class FaultKind : unsigned char {
  kNone,
  // in what the step was given
  kTime,          ///< not finite
  kPosition,      ///< a coordinate of q, not finite
  kQuaternion,    ///< not of unit length, see kQuaternionTolerance
  kVelocity,      ///< a coordinate of v, not finite
  kAppliedForce,  ///< not finite, as the next three
  kWrench,
  kServoPosition,  ///< target
  kServoVelocity,  ///< target
  // in the step
  kSingularInertia,  ///< what a joint moves has no inertia along it
  kConstraint,       ///< a constraint that cannot be posed: its law is not finite, or not valid
  kUnsolved,         ///< the solver did not come to the tolerance
  kNewVelocity,      ///< a coordinate of v after the step, not finite
  kNewPosition,      ///< a coordinate of q after the step, not finite
  kSpeed,            ///< faster than SimulationOptions::max_speed
  kTolerance,        ///< error of a controlled step of min_step, at this coordinate of v (or its q)
  kRecoveredForce,   ///< of an inverse, not finite
  kStaysOpen,        ///< a closure or mimic joint that does not close (StalledClosureDetector)
};
/// As in reports: "applied_force", "singular_inertia", ...
const char* fault_kind_name(FaultKind kind);

/// Which kind of constraint, for kConstraint and kUnsolved.
enum class ConstraintKind : unsigned char {
  kNone,
  kContact,
  kClosure,
  kLimit,  ///< of a joint's position or speed
  kMimic,
  kJointFriction,  ///< dry friction of a joint, or a servo with an effort limit
};

/// What made a coordinate so fast, for kSpeed.
enum class SpeedCause : unsigned char {
  kGiven,   ///< it was when the step began
  kDriven,  ///< applied forces, wrenches, servos, springs and gravity explain most of the energy
  kStep,    ///< they do not: the step is too long for this motion
};

/// Indices are -1 where there is no such thing.
struct Fault {
  FaultKind kind = FaultKind::kNone;
  ConstraintKind constraint = ConstraintKind::kNone;
  SpeedCause cause = SpeedCause::kGiven;
  int body = -1;        ///< at fault, or moved by what is; its joint is Model::joint(body - 1)
  int other_body = -1;  ///< the other one of a contact, closure or mimic; 0: the world
  int coordinate = -1;  ///< of q for the positions, else of v
  int geometry_a = -1, geometry_b = -1;  ///< of a contact
  int index = -1;  ///< closure in Model::closures, wrench in Input, servo in Model::servos
  double value =
      0.0;  ///< of what is named, SI; kUnsolved: by how much the velocity there is off
            ///< [m/s, rad/s]; kSpeed: of the mass moved [m/s]; kSingularInertia:
            ///< inertia; kTolerance: over what is allowed [-]; kStaysOpen: how far [m or rad]
  double bound = 0.0;  ///< in force: kSpeed: max_speed [m/s]; kTolerance: min_step [s];
                       ///< kStaysOpen: closing_time [s]

  bool any() const { return kind != FaultKind::kNone; }
};

/// The status of a step that failed by what it was given or what came out of it.
contact::Status status_of(const Fault& fault);

/// Quaternions further from unit length than this are a mistake, not round-off.
inline constexpr double kQuaternionTolerance = 1e-6;

/// The body that coordinate `index` of q moves, or of v.
int body_of_position(const Model& model, int index);
int body_of_velocity(const Model& model, int index);

/// A fault of coordinate `index` of q, or of v, and its value.
Fault position_fault(FaultKind kind, const Model& model, int index, double value);
Fault velocity_fault(FaultKind kind, const Model& model, int index, double value);

/// What is said of a fault.
struct FaultText {
  std::string element;  ///< name in the model: "elbow.u", "cube/body", "ball/0 - ground"
  std::string reason;   ///< "applied force 'elbow.u' is nan"
  std::string advice;   ///< "check what computes it"
};
FaultText describe(const Model& model, const Fault& fault);

// ---- Where the time of forward steps goes. A step reads the clock only where someone asks.

/// Added up over steps [s].
struct PhaseTimes {
  double contacts = 0.0;     ///< poses, contacts and the other constraints that may act
  double dynamics = 0.0;     ///< forces that need no solve, and the velocity that they lead to
  double constraints = 0.0;  ///< the contact problem: assembling and solving it
  double overlaps = 0.0;     ///< the recovery of overlaps
  double step = 0.0;         ///< the whole step; what the others leave is integration and checks
};

class Workspace;

/// Steps with this workspace add to `times` from here on, which must live as long; null: to none,
/// and no clock is read.
void measure_phases(Workspace& workspace, PhaseTimes* times);

/// Adds the time of its own life to one of them.
class PhaseTimer {
 public:
  PhaseTimer(PhaseTimes* times, double PhaseTimes::*phase) : times_(times), phase_(phase) {
    if (times_ != nullptr) start_ = Clock::now();
  }
  ~PhaseTimer() {
    if (times_ != nullptr)
      times_->*phase_ += std::chrono::duration<double>(Clock::now() - start_).count();
  }
  PhaseTimer(const PhaseTimer&) = delete;
  PhaseTimer& operator=(const PhaseTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  PhaseTimes* times_;
  double PhaseTimes::*phase_;
  Clock::time_point start_;
};

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
  /// The trees that nothing outside touched in the last step or inverse. Their centre of mass moves
  /// by outer forces alone, and their base's translation is not q (+) h v+
  /// (docs/explanation/integrators.md#momentum).
  std::span<const int> free_trees() const;

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
  int taut_links = 0;            ///< that turned more slowly than they would (taut_links.h)
  double largest_inertia = 1.0;  ///< of these, times their own
  /// What is wrong, if the step did not succeed; if it did, the closure or mimic joint of which
  /// Simulator sees that it stays open.
  Fault fault;
  bool succeeded() const { return contact::succeeded(status); }
};

/// A step that failed; steps are counted from 0, the time [s] is that of its start.
struct FailedStep {
  long step = 0;
  double time = 0.0;
  StepReport report;
};

/// Advances `state` by options.time_step [s] under `input`. On failure (report.succeeded() is
/// false) report.fault says what is wrong, and `next` must not be trusted. @throws InputError where
/// the sizes are not the model's, or the time step is not positive.
StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace,
                        State& next);  // Parameters: what it depends on, one by one

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
/// velocity-dependent forces take a linear solve (velocity_predictor.h). All sizes as in State.
/// `known`: what is known of the input, wrenches and servo targets (its applied force is not used);
/// without it there are no wrenches, and the targets are the model's. Where a motor was at its
/// effort limit the force recovered is the one on the limit (limit_applied_forces; of servos: their
/// effort limits). q_next: coordinates at the end, needed by implicit_midpoint where there are
/// constraints, else not looked at and may be null. @throws InputError for an integrator without
/// inverse.
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
