// Servo damping given as a ratio of critical damping.
#pragma once

#include <vector>

#include "counterpoint/model/robot_files.h"

namespace counterpoint::mjcf {

struct DampingRatio {
  int actuator = 0;  ///< index into MjcfModel::actuators
  int joint = 0;     ///< index into RobotSpec::joints
  double ratio = 0.0;
  double stiffness = 0.0;  ///< actuator force per transmission length
  double lever = 1.0;      ///< transmission length per joint coordinate
};

/// Adds the damping 2 ratio sqrt(stiffness m) per transmission length, with the inertia m that the
/// actuator feels in the reference pose: the diagonal entry of the mass matrix over lever^2.
void apply_damping_ratios(const std::vector<DampingRatio>& ratios, MjcfModel& model);

}  // namespace counterpoint::mjcf
