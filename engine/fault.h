// The reason why a step failed: the kind of fault, the body, joint, contact, closure or coordinate
// at fault, its size, and advice for the user.
#pragma once

#include <string>

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

enum class FaultKind : unsigned char {
  kNone,
  // in the arguments of the step
  kTime,          ///< not finite
  kPosition,      ///< a coordinate of q, not finite
  kQuaternion,    ///< not of unit length, see kQuaternionTolerance
  kVelocity,      ///< a coordinate of v, not finite
  kAppliedForce,  ///< not finite, like the next nine
  kWrench,
  kServoPosition,  ///< target
  kServoVelocity,  ///< target
  kTendonForce,
  kTendonTarget,
  kCommand,        ///< command of an actuator
  kAttach,         ///< input of a switched closure
  kPrescribed,     ///< prescribed coordinate
  kInternalState,  ///< entry of z
  // in the step
  kSingularInertia,  ///< the bodies that a joint moves have no inertia along it
  kConstraint,       ///< a constraint whose law is not finite, or not valid
  kUnsolved,         ///< the solver did not reach the tolerance
  kNewVelocity,      ///< a coordinate of v after the step, not finite
  kNewPosition,      ///< a coordinate of q after the step, not finite
  kSpeed,            ///< faster than SimulationOptions::max_speed
  kTolerance,        ///< error of a controlled step of min_step, at this coordinate of v (or its q)
  kRecoveredForce,   ///< force recovered by an inverse, not finite
  kStaysOpen,        ///< a closure or mimic joint that does not close (StalledClosureDetector)
};
/// Returns the name in reports: "applied_force", "singular_inertia", ...
const char* fault_kind_name(FaultKind kind);

/// Kind of the constraint of kConstraint and kUnsolved.
enum class ConstraintKind : unsigned char {
  kNone,
  kContact,
  kClosure,
  kLimit,  ///< position or speed limit of a joint
  kMimic,
  kJointFriction,  ///< dry friction of a joint, or a servo with an effort limit
  kTendon,
  kActuator,
};

/// Why a coordinate is too fast, for kSpeed.
enum class SpeedCause : unsigned char {
  kGiven,   ///< it was too fast when the step began
  kDriven,  ///< applied forces, wrenches, servos, springs and gravity explain most of the energy
  kStep,    ///< they do not: the step is too long for this motion
};

/// The fault of a step. Indices are -1 where they do not apply.
struct Fault {
  FaultKind kind = FaultKind::kNone;
  ConstraintKind constraint = ConstraintKind::kNone;
  SpeedCause cause = SpeedCause::kGiven;
  int body = -1;        ///< body at fault, or moved by the joint at fault (Model::joint(body - 1))
  int other_body = -1;  ///< other body of a contact, closure or mimic; 0: the world
  int coordinate = -1;  ///< index into q for positions, else into v
  int geometry_a = -1, geometry_b = -1;  ///< geometries of a contact
  int index = -1;  ///< closure in Model::closures, wrench in Input, servo in Model::servos,
                   ///< tendon in Model::tendons, actuator in Model::actuators, entry of z
  /// Value of the named quantity, SI. kUnsolved: error of the velocity there [m/s, rad/s]; kSpeed:
  /// speed of the mass moved [m/s]; kSingularInertia: inertia; kTolerance: error over the allowed
  /// one [-]; kStaysOpen: opening [m or rad].
  double value = 0.0;
  /// Limit in force. kSpeed: max_speed [m/s]; kTolerance: min_step [s]; kStaysOpen: closing_time
  /// [s].
  double bound = 0.0;

  bool any() const { return kind != FaultKind::kNone; }
};

/// Returns the status of a step that failed by its arguments or its result.
contact::Status status_of(const Fault& fault);

/// Largest deviation of a quaternion from unit length that counts as round-off.
inline constexpr double kQuaternionTolerance = 1e-6;

/// Return the body that a coordinate of q, or of v, moves.
int body_of_position(const Model& model, int index);
int body_of_velocity(const Model& model, int index);

/// Return a fault of coordinate `index` of q, or of v, with its value.
Fault position_fault(FaultKind kind, const Model& model, int index, double value);
Fault velocity_fault(FaultKind kind, const Model& model, int index, double value);

/// Text of a fault for messages.
struct FaultText {
  std::string element;  ///< name in the model: "elbow.u", "cube/body", "ball/0 - ground"
  std::string reason;   ///< "applied force 'elbow.u' is nan"
  std::string advice;   ///< "check what computes it"
};
FaultText describe(const Model& model, const Fault& fault);

}  // namespace counterpoint
