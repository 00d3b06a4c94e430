// Damping of servos that is given as a share of the critical one.
#pragma once

#include <vector>

#include "counterpoint/model/robot_files.h"

namespace counterpoint::mjcf {

struct DampingRatio {
  int actuator = 0;  ///< index into MjcfModel::actuators
  int joint = 0;     ///< index into RobotSpec::joints
  double ratio = 0.0;
  double stiffness = 0.0;  ///< of the actuator, per length of its transmission
  double lever = 1.0;      ///< length of the transmission per coordinate
};

/// 2 ratio sqrt(stiffness m) with the inertia m that the actuator feels in the reference pose: the
/// diagonal entry of the mass matrix over lever^2.
void apply_damping_ratios(const std::vector<DampingRatio>& ratios, MjcfModel& model);

}  // namespace counterpoint::mjcf
