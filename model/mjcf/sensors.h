// <sensor>: the quantities of MuJoCo's sensors that sensors of the scene have too.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"

namespace counterpoint::mjcf {

/// The attribute of an element of <sensor> that names its object.
enum class Sensed { kSite, kJoint, kFrame, kSubtree, kTendon, kActuator };

/// An element of <sensor> that has a counterpart.
struct SensorElement {
  const char* name;
  SensorKind kind;
  Sensed object;
  bool own_axes;  ///< whether vectors are along the site's axes
};

/// All of them. framelinacc is a specific force: MuJoCo's includes -gravity.
inline constexpr SensorElement kSensorElements[] = {
    {"accelerometer", SensorKind::kSpecificForce, Sensed::kSite, true},
    {"velocimeter", SensorKind::kLinearVelocity, Sensed::kSite, true},
    {"gyro", SensorKind::kAngularVelocity, Sensed::kSite, true},
    {"force", SensorKind::kForce, Sensed::kSite, true},
    {"torque", SensorKind::kTorque, Sensed::kSite, true},
    {"rangefinder", SensorKind::kRange, Sensed::kSite, false},
    {"jointpos", SensorKind::kJointPosition, Sensed::kJoint, false},
    {"jointvel", SensorKind::kJointVelocity, Sensed::kJoint, false},
    {"jointactuatorfrc", SensorKind::kJointEffort, Sensed::kJoint, false},
    {"ballquat", SensorKind::kJointPosition, Sensed::kJoint, false},
    {"ballangvel", SensorKind::kJointVelocity, Sensed::kJoint, false},
    {"framepos", SensorKind::kPosition, Sensed::kFrame, false},
    {"framequat", SensorKind::kOrientation, Sensed::kFrame, false},
    {"framelinvel", SensorKind::kLinearVelocity, Sensed::kFrame, false},
    {"frameangvel", SensorKind::kAngularVelocity, Sensed::kFrame, false},
    {"framelinacc", SensorKind::kSpecificForce, Sensed::kFrame, false},
    {"frameangacc", SensorKind::kAngularAcceleration, Sensed::kFrame, false},
    {"subtreecom", SensorKind::kCenterOfMass, Sensed::kSubtree, false},
    {"subtreelinvel", SensorKind::kCenterOfMassVelocity, Sensed::kSubtree, false},
    {"subtreeangmom", SensorKind::kAngularMomentum, Sensed::kSubtree, false},
    {"touch", SensorKind::kTouch, Sensed::kSite, false},
    {"tendonpos", SensorKind::kTendonLength, Sensed::kTendon, false},
    {"tendonvel", SensorKind::kTendonVelocity, Sensed::kTendon, false},
    {"actuatorpos", SensorKind::kActuatorPosition, Sensed::kActuator, false},
    {"actuatorvel", SensorKind::kActuatorVelocity, Sensed::kActuator, false},
    {"actuatorfrc", SensorKind::kActuatorForce, Sensed::kActuator, false}};

/// Adds the sensors that are supported to model.sensors, and notes the others
/// (docs/reference/mjcf.md). Call after read_inertias.
void read_sensors(Document& document, const Defaults& defaults, const Bodies& bodies,
                  MjcfModel& model);

}  // namespace counterpoint::mjcf
