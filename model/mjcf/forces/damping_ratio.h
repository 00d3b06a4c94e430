// Damping given as a ratio of critical damping: of servos, of springs in joints.
#pragma once

#include <vector>

#include "counterpoint/model/mjcf/bodies/bodies.h"

namespace counterpoint::mjcf {

struct DampingRatio {
  int actuator = 0;  ///< index into MjcfModel::actuators
  int joint = 0;     ///< index into RobotSpec::joints; the joint whose servo it is
  int driven = 0;    ///< the joint that it drives, which may follow `joint`
  double ratio = 0.0;
  double stiffness = 0.0;  ///< actuator force per transmission length
  double lever = 1.0;      ///< transmission length per coordinate of `joint`
  double gear = 1.0;       ///< the same of `driven`
};

/// Adds the damping 2 ratio sqrt(stiffness m) per transmission length, with the inertia m that the
/// actuator feels in the reference pose: the diagonal entry of the mass matrix of the joint that it
/// drives, over gear^2.
void apply_damping_ratios(const std::vector<DampingRatio>& ratios, MjcfModel& model);

/// Sets the springs and dampers of joints with a springdamper of time constant T and ratio z:
/// stiffness m / (T z)^2, damping 2 m / T, with m the inverse of the joint's entry of inv(M) in the
/// reference pose. Call after read_inertias.
void apply_spring_dampers(const Bodies& bodies, MjcfModel& model);

}  // namespace counterpoint::mjcf
