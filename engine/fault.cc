#include <fmt/format.h>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint {
namespace {

std::string pair_name(const std::string& a, const std::string& b) { return a + " - " + b; }

const std::string& joint_name(const Model& model, int body) { return model.joint(body - 1).name; }

std::string constraint_name(const Model& model, const Fault& fault) {
  switch (fault.constraint) {
    case ConstraintKind::kContact:
      return pair_name(model.geometries()[fault.geometry_a].name,
                       model.geometries()[fault.geometry_b].name);
    case ConstraintKind::kClosure:
      return model.closures()[fault.index].name;
    case ConstraintKind::kTendon:
      return model.tendons()[static_cast<size_t>(fault.index)].name;
    case ConstraintKind::kActuator:
      return model.actuators()[static_cast<size_t>(fault.index)].name;
    case ConstraintKind::kMimic:
      return pair_name(joint_name(model, fault.body), joint_name(model, fault.other_body));
    case ConstraintKind::kLimit:
    case ConstraintKind::kJointFriction:
      return joint_name(model, fault.body);
    case ConstraintKind::kNone:
      break;
  }
  return fault.body > 0 ? joint_name(model, fault.body) : "";
}

const char* constraint_words(ConstraintKind kind) {
  switch (kind) {
    case ConstraintKind::kContact:
      return "contact";
    case ConstraintKind::kClosure:
      return "closure";
    case ConstraintKind::kLimit:
      return "limit of joint";
    case ConstraintKind::kMimic:
      return "mimic joint";
    case ConstraintKind::kJointFriction:
      return "dry friction or motor of joint";
    case ConstraintKind::kTendon:
      return "tendon";
    case ConstraintKind::kActuator:
      return "actuator";
    case ConstraintKind::kNone:
      break;
  }
  return "mass matrix at joint";
}

std::string servo_name(const Model& model, const Fault& fault, const char* suffix) {
  return model.joint(model.servos()[fault.index].joint).name + suffix;
}

std::string element(const Model& model, const Fault& fault) {
  const auto at = [&](const std::vector<std::string>& names) {
    return names[static_cast<std::size_t>(fault.coordinate)];
  };
  switch (fault.kind) {
    case FaultKind::kNone:
      return "";
    case FaultKind::kTime:
      return "time";
    case FaultKind::kPosition:
    case FaultKind::kNewPosition:
      return at(coordinate_names(model).q);
    case FaultKind::kVelocity:
    case FaultKind::kNewVelocity:
    case FaultKind::kSpeed:
    case FaultKind::kTolerance:
      return at(coordinate_names(model).v);
    case FaultKind::kAppliedForce:
    case FaultKind::kRecoveredForce:
      return at(coordinate_names(model).force);
    case FaultKind::kQuaternion:
    case FaultKind::kWrench:
      return fault.body > 0 ? model.joint(fault.body - 1).link : "world";
    case FaultKind::kServoPosition:
      return servo_name(model, fault, ".target");
    case FaultKind::kServoVelocity:
      return servo_name(model, fault, ".target_velocity");
    case FaultKind::kTendonForce:
    case FaultKind::kTendonTarget:
      return model.tendons()[static_cast<size_t>(fault.index)].name;
    case FaultKind::kCommand:
      return model.actuators()[static_cast<size_t>(fault.index)].name;
    case FaultKind::kAttach:
      return model.closures()[static_cast<size_t>(fault.index)].name;
    case FaultKind::kPrescribed:
      return at(coordinate_names(model).q);
    case FaultKind::kInternalState:
      return coordinate_names(model).z[static_cast<size_t>(fault.index)];
    case FaultKind::kSingularInertia:
      return joint_name(model, fault.body);
    case FaultKind::kConstraint:
    case FaultKind::kUnsolved:
    case FaultKind::kStaysOpen:
      return constraint_name(model, fault);
  }
  return "";
}

// Long: one case per kind, so that the compiler reports a missing one.
std::string reason(const Fault& fault, const std::string& name) {
  const auto is = [&](const char* what) {
    return fmt::format("{} '{}' is {:.6g}", what, name, fault.value);
  };
  switch (fault.kind) {
    case FaultKind::kNone:
      return "";
    case FaultKind::kTime:
      return fmt::format("the time is {:.6g}", fault.value);
    case FaultKind::kPosition:
      return is("position");
    case FaultKind::kQuaternion:
      return fmt::format("quaternion of '{}' has length {:.9g}, not 1", name, fault.value);
    case FaultKind::kVelocity:
      return is("velocity");
    case FaultKind::kAppliedForce:
      return is("applied force");
    case FaultKind::kWrench:
      return fmt::format("wrench {} on '{}' holds {:.6g}", fault.index, name, fault.value);
    case FaultKind::kServoPosition:
    case FaultKind::kServoVelocity:
      return is("servo target");
    case FaultKind::kTendonForce:
      return is("force of tendon");
    case FaultKind::kTendonTarget:
      return is("target length of tendon");
    case FaultKind::kCommand:
      return is("command of actuator");
    case FaultKind::kAttach:
      return is("input of switched closure");
    case FaultKind::kPrescribed:
      return is("prescribed coordinate");
    case FaultKind::kInternalState:
      return is("internal state");
    case FaultKind::kSingularInertia:
      return fmt::format("joint '{}' moves no inertia in this pose ({:.3g})", name, fault.value);
    case FaultKind::kConstraint:
      return fmt::format("{} '{}' cannot be posed: a value is not finite, or out of its range",
                         constraint_words(fault.constraint), name);
    case FaultKind::kUnsolved:
      if (name.empty()) return "the velocity in the middle of the step was not found";
      return fmt::format("not solved, worst at {} '{}', where the velocity is off by {:.3g}",
                         constraint_words(fault.constraint), name, fault.value);
    case FaultKind::kNewVelocity:
      return fmt::format("velocity '{}' came out as {:.6g}", name, fault.value);
    case FaultKind::kNewPosition:
      return fmt::format("position '{}' came out as {:.6g}", name, fault.value);
    case FaultKind::kSpeed:
      return fmt::format("'{}' moves mass at {:.4g} m/s; max_speed is {:.4g} m/s", name,
                         fault.value, fault.bound);
    case FaultKind::kTolerance:
      return fmt::format(
          "the error of '{}', or of what it moves, is {:.3g} times the tolerance in "
          "the shortest step, {:.3g} s",
          name, fault.value, fault.bound);
    case FaultKind::kRecoveredForce:
      return fmt::format("recovered force '{}' came out as {:.6g}", name, fault.value);
    case FaultKind::kStaysOpen:
      return fmt::format("{} '{}' stays open by {:.3g} (m or rad), no closer for {:.3g} s",
                         constraint_words(fault.constraint), name, fault.value, fault.bound);
  }
  return "";
}

std::string speed_advice(SpeedCause cause) {
  switch (cause) {
    case SpeedCause::kGiven:
      return "it was that fast when the step began; check the velocity given, or raise max_speed";
    case SpeedCause::kDriven:
      return "forces given drive it (applied, wrench, servo, spring, gravity); reduce them, or "
             "raise max_speed";
    case SpeedCause::kStep:
      return "no force given explains it: the time step is too long for so fast a motion; try a "
             "tenth of it";
  }
  return "";
}

std::string advice(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::kNone:
      return "";
    case FaultKind::kTime:
    case FaultKind::kPosition:
    case FaultKind::kVelocity:
    case FaultKind::kAppliedForce:
    case FaultKind::kWrench:
    case FaultKind::kServoPosition:
    case FaultKind::kServoVelocity:
    case FaultKind::kTendonForce:
    case FaultKind::kTendonTarget:
    case FaultKind::kCommand:
    case FaultKind::kAttach:
    case FaultKind::kPrescribed:
    case FaultKind::kInternalState:
      return "check what computes it";
    case FaultKind::kQuaternion:
      return fmt::format("normalize it (to {:g})", kQuaternionTolerance);
    case FaultKind::kSingularInertia:
      return "give a link it carries mass and inertia about it, or the joint an armature";
    case FaultKind::kConstraint:
      return "check the scene's contact options, its surfaces, and for values beyond all measure";
    case FaultKind::kUnsolved:
      return "try half the time step, or a larger compliance or smoothing (contact: in the scene)";
    case FaultKind::kNewVelocity:
    case FaultKind::kNewPosition:
    case FaultKind::kRecoveredForce:
      return "a force or speed is beyond all measure, or the time step far too long";
    case FaultKind::kSpeed:
      return speed_advice(fault.cause);
    case FaultKind::kTolerance:
      return "raise the tolerance, lower min_step, or switch strict off, and such steps are "
             "counted";
    case FaultKind::kStaysOpen:
      return "what it holds may be out of reach, blocked, or held by limits: check where it acts; "
             "closing_time: none lets it be";
  }
  return "";
}

int body_of(const Model& model, int index, int Body::*first) {
  int body = model.num_bodies() - 1;
  while (body > 1 && model.body(body).*first > index) --body;
  return body;
}

Fault coordinate_fault(FaultKind kind, int body, int index, double value) {
  Fault fault;
  fault.kind = kind;
  fault.body = body;
  fault.coordinate = index;
  fault.value = value;
  return fault;
}

}  // namespace

int body_of_position(const Model& model, int index) {
  return body_of(model, index, &Body::q_index);
}

int body_of_velocity(const Model& model, int index) {
  return body_of(model, index, &Body::v_index);
}

Fault position_fault(FaultKind kind, const Model& model, int index, double value) {
  return coordinate_fault(kind, body_of_position(model, index), index, value);
}

Fault velocity_fault(FaultKind kind, const Model& model, int index, double value) {
  return coordinate_fault(kind, body_of_velocity(model, index), index, value);
}

const char* fault_kind_name(FaultKind kind) {
  switch (kind) {
    case FaultKind::kNone:
      return "none";
    case FaultKind::kTime:
      return "time";
    case FaultKind::kPosition:
      return "position";
    case FaultKind::kQuaternion:
      return "quaternion";
    case FaultKind::kVelocity:
      return "velocity";
    case FaultKind::kAppliedForce:
      return "applied_force";
    case FaultKind::kWrench:
      return "wrench";
    case FaultKind::kServoPosition:
      return "servo_position";
    case FaultKind::kServoVelocity:
      return "servo_velocity";
    case FaultKind::kTendonForce:
      return "tendon_force";
    case FaultKind::kTendonTarget:
      return "tendon_target";
    case FaultKind::kCommand:
      return "command";
    case FaultKind::kAttach:
      return "attach";
    case FaultKind::kPrescribed:
      return "prescribed";
    case FaultKind::kInternalState:
      return "internal_state";
    case FaultKind::kSingularInertia:
      return "singular_inertia";
    case FaultKind::kConstraint:
      return "constraint";
    case FaultKind::kUnsolved:
      return "unsolved";
    case FaultKind::kNewVelocity:
      return "new_velocity";
    case FaultKind::kNewPosition:
      return "new_position";
    case FaultKind::kSpeed:
      return "speed";
    case FaultKind::kTolerance:
      return "tolerance";
    case FaultKind::kRecoveredForce:
      return "recovered_force";
    case FaultKind::kStaysOpen:
      return "stays_open";
  }
  return "unknown";
}

contact::Status status_of(const Fault& fault) {
  if (fault.kind == FaultKind::kQuaternion) return contact::Status::kInvalidState;
  if (fault.kind == FaultKind::kSpeed) return contact::Status::kDiverged;
  if (fault.kind == FaultKind::kTolerance || fault.kind == FaultKind::kStaysOpen)
    return contact::Status::kNoProgress;
  return contact::Status::kNotFinite;
}

FaultText describe(const Model& model, const Fault& fault) {
  const std::string name = element(model, fault);
  return {name, reason(fault, name), advice(fault)};
}

}  // namespace counterpoint
