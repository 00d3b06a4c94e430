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
  /// Largest difference of joint forces (servos without control, springs, dampers), relative to the
  /// force; for hinges and slides without mimic joints.
  double joint_force = 0.0;
  /// Largest differences of a tendon's length and moment arms, relative to 1 m and 1 m/rad or to
  /// the value if it is larger. `joint_force` includes the forces of tendons.
  double tendon = 0.0;
  int tendons = 0;       ///< number of tendons compared
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

/// Version of MuJoCo, such as "3.12.1".
std::string mujoco_used();

}  // namespace counterpoint::apps
