// One MJCF file read by us and by MuJoCo, side by side.
#pragma once

#include <filesystem>
#include <string>

#include "counterpoint/model/robot_files.h"

namespace counterpoint::apps {

struct MjcfComparison {
  std::string refused;     ///< why we do not read it; empty: we do
  std::string unreadable;  ///< why MuJoCo does not
  int bodies = 0, nv = 0;
  double pose = 0.0;  ///< largest difference of a body's position or rotation matrix [m, -]
  double mass = 0.0;  ///< of M_ij over sqrt(M_ii M_jj)
  /// Of the forces in joints (servos without control, springs, dampers) over the force there;
  /// hinges and slides that no other follows.
  double joint_force = 0.0;
  double inertia = 0.0;  ///< of a body's rotational inertia, over its own norm
  double bias = 0.0;     ///< of bias forces over the largest of the state
  /// `mass` and `bias` with the inertias that MuJoCo made of those in the file: it leaves up to
  /// 1e-12 off the diagonal of what it takes for principal axes.
  double mass_with_theirs = 0.0, bias_with_theirs = 0.0;
  int notes = 0;
};

/// At `states` random states.
MjcfComparison compare_with_mujoco(const std::filesystem::path& file, int states,
                                   const MjcfOptions& options = {});

/// "3.12.1".
std::string mujoco_used();

}  // namespace counterpoint::apps
