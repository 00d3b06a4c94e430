// Simulation of MJCF files by MuJoCo itself, to check exported scenes, and its sensors, to check
// ours.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::peers {

/// Steps MuJoCo through a file for `seconds` [s] from its first keyframe, or from its reference
/// pose if it has none, with no controls. Returns X_WB of all bodies, the world first, in the order
/// of the file.
/// @throws NotExpressible if the file is refused, a step fails, or MuJoCo is not there.
std::vector<Pose> play_mjcf(const std::string& path, double seconds);

/// MuJoCo's accelerations (nv) [m/s^2, rad/s^2] at one state, and its readings there by name.
struct MjcfReadings {
  VectorX acceleration;
  std::map<std::string, VectorX> sensors;
};

/// Evaluates MuJoCo's sensors of a file at (q, v), nq and nv as MuJoCo counts them, with every
/// control at `control`. @throws NotExpressible as play_mjcf, and where a size differs.
MjcfReadings read_mjcf_sensors(const std::string& path, const VectorX& q, const VectorX& v,
                               double control);

}  // namespace counterpoint::peers
