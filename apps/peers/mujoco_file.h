// Simulation of MJCF files by MuJoCo itself, to check exported scenes.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::peers {

/// Steps MuJoCo through a file for `seconds` [s] from its first keyframe, or from its reference
/// pose if it has none, with no controls. Returns X_WB of all bodies, the world first, in the order
/// of the file.
/// @throws NotExpressible if the file is refused, a step fails, or MuJoCo is not there.
std::vector<Pose> play_mjcf(const std::string& path, double seconds);

}  // namespace counterpoint::peers
