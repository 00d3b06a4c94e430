// Comparison of one MJCF file as read by us and by MuJoCo.
#pragma once

#include <filesystem>
#include <string>

#include "counterpoint/model/robot_files.h"

namespace counterpoint::apps {

struct MjcfComparison {
  std::string refused;     ///< why we refuse the file; empty: we read it
  std::string unreadable;  ///< why MuJoCo refuses it; empty: it reads it
  int bodies = 0, nv = 0;
  double pose = 0.0;  ///< largest difference of a body's position or rotation matrix [m, -]
  double mass = 0.0;  ///< largest difference of M_ij over sqrt(M_ii M_jj)
  // Largest differences of quantities at any state, each over its largest size:
  /// Joint forces: springs, dampers, servos and motors of joints and tendons, and actuators.
  double joint_force = 0.0;
  double actuator_force = 0.0;  ///< forces of actuators with a command of their own
  double tendon_length = 0.0;
  double tendon_arms = 0.0;  ///< moment arms of a tendon, over its longest
  int tendons = 0;           ///< number of tendons compared
  /// Numbers of actuators with a command of their own, of servos and motors, and of those that have
  /// no counterpart and get no control in the comparison.
  int commanded = 0, servos = 0, without_counterpart = 0;
  double inertia = 0.0;  ///< largest difference of a body's rotational inertia, over its norm
  double bias = 0.0;     ///< largest difference of bias forces, over the largest bias force of the
                         ///< state
  /// `mass` and `bias` with the inertias that MuJoCo derives from those in the file: its principal
  /// axes leave up to 1e-12 off the diagonal.
  double mass_with_theirs = 0.0, bias_with_theirs = 0.0;
  int notes = 0;
};

/// Compares at `states` random states.
MjcfComparison compare_with_mujoco(const std::filesystem::path& file, int states,
                                   const MjcfOptions& options = {});

/// Registers the plugins of a library of MuJoCo, such as libactuator.so.
void load_plugins(const std::filesystem::path& file);

/// Version of MuJoCo, such as "3.12.1".
std::string mujoco_used();

}  // namespace counterpoint::apps
