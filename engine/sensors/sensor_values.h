// The formulas of sensors: values of one sensor from the kinematics and forces of a step.
#pragma once

#include <vector>

#include "counterpoint/engine/forces/tendons.h"
#include "counterpoint/engine/sensors/joint_wrenches.h"

namespace counterpoint {

/// The quantities of a step that the formulas use; a member that no sensor needs may be out of
/// date.
struct SensedMotion {
  const Model& model;
  VectorRef q, v;                ///< nq, nv, at the start of the step
  const Kinematics& at;          ///< poses and velocities of the bodies there
  const std::vector<Motion>& A;  ///< per body: spatial acceleration with that of gravity, in W
  Vector3 gravity;               ///< [m/s^2] in W, zero where it is off
  const Tendons& tendons;        ///< lengths and moment arms at q
  const Inverse& inverse;
};

/// A sensor with what follows from the model alone.
struct PlacedSensor {
  PlacedSensor(const Model& model, int index);

  const Sensor* sensor;
  CarriedPart part;  ///< for wrenches and momenta
};

/// Writes one quantity of a sensor, not a wrench nor a range, into `out`.
void sensed_value(const SensedMotion& motion, const PlacedSensor& placed, SensorKind kind,
                  double* out);

/// Returns the pose of a sensor's frame in W.
Pose sensor_pose(const Model& model, const Sensor& sensor, const Kinematics& at);

/// Returns the distance from the sensor along the z axis of its frame to the nearest geometry [m];
/// NaN beyond the sensor's limit. Geometries that move with the sensor's body, or for a sensor on
/// the world those of its own link, are not seen.
double range_to(const Model& model, const Sensor& sensor, const Kinematics& at);

}  // namespace counterpoint
