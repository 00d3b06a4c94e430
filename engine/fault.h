// Why a step failed: the kind of fault, the body, joint, contact, closure or coordinate at fault,
// how large it is, and what a user can do.
#pragma once

#include <string>

#include "counterpoint/contact/solver.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

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
  kStaysOpen,        ///< a closure or mimic joint that does not close (stalled_closure.h)
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
  int index = -1;      ///< closure in Model::closures, wrench in Input, servo in Model::servos
  double value = 0.0;  ///< of what is named, SI; kUnsolved: by how much the velocity there is off
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

}  // namespace counterpoint
