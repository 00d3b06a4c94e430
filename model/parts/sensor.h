// Sensors of a model: named quantities that follow from the motion in a step, and the errors of
// their readings. engine/sensors/sensor_table.h computes them; docs/reference/sensors.md has the
// formula of each kind.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

class Model;

/// One vector of a reading. The sensor frame S is fixed to a link; R is a reference frame, by
/// default the world W.
enum class SensorKind : unsigned char {
  kPosition,              ///< origin of S in R [m]
  kOrientation,           ///< quaternion w, x, y, z of the rotation from S to R
  kLinearVelocity,        ///< velocity of the origin of S relative to R [m/s]
  kAngularVelocity,       ///< angular velocity of S relative to R [rad/s]
  kLinearAcceleration,    ///< acceleration of the origin of S [m/s^2]
  kAngularAcceleration,   ///< angular acceleration of S [rad/s^2]
  kSpecificForce,         ///< acceleration of the origin of S minus gravity [m/s^2]
  kForce,                 ///< force on the link from the one that it hangs on, along S [N]
  kTorque,                ///< torque of the same about the origin of S, along S [N m]
  kContactForce,          ///< sum of contact forces on a link or geometry [N]
  kJointPosition,         ///< coordinates q of a joint [rad, m]
  kJointVelocity,         ///< velocities v of a joint [rad/s, m/s]
  kJointEffort,           ///< applied and servo force in the coordinates of a joint [N m, N]
  kRange,                 ///< distance along the z axis of S to the nearest surface [m]
  kCenterOfMass,          ///< centre of mass of a link with what hangs on it, or of the scene [m]
  kCenterOfMassVelocity,  ///< its velocity, in W [m/s]
  kLinearMomentum,        ///< momentum of the same, in W [kg m/s]
  kAngularMomentum,       ///< angular momentum about its centre of mass, in W [kg m^2/s]
  kTouch,                 ///< sum of normal forces of contacts on a link or geometry [N]
  kPressure,              ///< the same over the area of Sensor::size [Pa]
  kTendonLength,          ///< length of a tendon [m]
  kTendonVelocity,        ///< its rate [m/s]
  kTendonForce,           ///< force along it, actuators included; pulling is negative [N]
  kActuatorPosition,      ///< gear times the coordinate that an actuator drives [m, rad]
  kActuatorVelocity,      ///< its rate [m/s, rad/s]
  kActuatorForce,         ///< force of an actuator, before its gear [N, N m]
};
inline constexpr int kNumSensorKinds = static_cast<int>(SensorKind::kActuatorForce) + 1;

/// Returns "position", "specific_force" ..., as scene files have it.
const char* sensor_kind_name(SensorKind kind);

/// Errors of readings: reading = exact + bias + noise, rounded to multiples of the quantum, sampled
/// and delayed. Lists are empty, or have one number a row in the unit of the row.
struct SensorErrors {
  std::vector<double> bias;
  std::vector<double> noise;    ///< standard deviation of white noise
  std::vector<double> quantum;  ///< zero: not rounded
  double rate = 0.0;            ///< samples per second, held in between; zero: one for every row
  double delay = 0.0;           ///< [s]

  bool any() const {
    return !bias.empty() || !noise.empty() || !quantum.empty() || rate > 0.0 || delay > 0.0;
  }
  bool operator==(const SensorErrors&) const = default;
};

/// A sensor with the quantities that it reads, one after the other.
struct Sensor {
  std::string name;               ///< unique
  std::vector<SensorKind> kinds;  ///< one at least
  int frame = -1;                 ///< Model::frames of its link; -1: the world
  Pose X_FS;                      ///< sensor frame in that frame
  /// Frame R of the reference, for positions, orientations and velocities; -1: the world.
  int reference = -1;
  bool own_axes = false;  ///< vectors are expressed along S instead of R
  int joint = -1;         ///< for kinds of joints: index into Model::joints
  int tendon = -1;        ///< for kinds of tendons: index into Model::tendons
  int actuator = -1;      ///< for kinds of actuators: index into Model::actuators
  /// Kinds of contacts: the geometries on which the forces act, ascending, and those that exert
  /// them (empty: all others).
  std::vector<int> geometries, others;
  /// kTouch, kPressure: edges of a box about the origin of S, along its axes; contacts outside do
  /// not count [m].
  Vector3 size = Vector3::Constant(std::numeric_limits<double>::infinity());
  /// kRange: largest distance that is measured [m].
  double limit = std::numeric_limits<double>::infinity();
  SensorErrors errors;
};

/// Whether the kind concerns a joint's coordinates; the quantities of links do not.
constexpr bool senses_joint(SensorKind kind) {
  return kind == SensorKind::kJointPosition || kind == SensorKind::kJointVelocity ||
         kind == SensorKind::kJointEffort;
}
/// Whether the kind concerns a tendon.
constexpr bool senses_tendon(SensorKind kind) {
  return kind >= SensorKind::kTendonLength && kind <= SensorKind::kTendonForce;
}
/// Whether the kind concerns an actuator.
constexpr bool senses_actuator(SensorKind kind) { return kind >= SensorKind::kActuatorPosition; }
/// Whether the kind concerns a named part other than a link.
constexpr bool senses_part(SensorKind kind) {
  return senses_joint(kind) || senses_tendon(kind) || senses_actuator(kind);
}
/// Whether the kind is a sum over contacts.
constexpr bool senses_contacts(SensorKind kind) {
  return kind == SensorKind::kContactForce || kind == SensorKind::kTouch ||
         kind == SensorKind::kPressure;
}
/// Whether the kind concerns a link with all that hangs on it.
constexpr bool senses_subtree(SensorKind kind) {
  return kind == SensorKind::kCenterOfMass || kind == SensorKind::kCenterOfMassVelocity ||
         kind == SensorKind::kLinearMomentum || kind == SensorKind::kAngularMomentum;
}
/// Whether the kind is a wrench between two links.
constexpr bool senses_wrench(SensorKind kind) {
  return kind == SensorKind::kForce || kind == SensorKind::kTorque;
}
/// Whether the kind takes Sensor::reference.
constexpr bool takes_reference(SensorKind kind) { return kind <= SensorKind::kAngularVelocity; }
/// Whether the kind is a vector that may be along S; a wrench always is.
constexpr bool takes_axes(SensorKind kind) {
  return kind >= SensorKind::kLinearVelocity && kind <= SensorKind::kContactForce;
}

/// One row of a sensor.
struct SensorRow {
  std::string suffix;  ///< "ax", "qw", "range": a column is called SENSOR.SUFFIX
  std::string unit;
};
/// Returns the rows of one kind of a sensor of this model, in order.
std::vector<SensorRow> sensor_rows(const Model& model, const Sensor& sensor, SensorKind kind);
/// Returns the rows of all its kinds.
std::vector<SensorRow> sensor_rows(const Model& model, const Sensor& sensor);

/// True if the force between the frame's link and the one that it hangs on does not pass through a
/// joint: both are parts of one body, or of the world.
bool is_welded(const Model& model, int frame);

}  // namespace counterpoint
