// Motions that commands read.
#pragma once

#include <string>

#include "counterpoint/engine/motion_files.h"

namespace counterpoint::apps {

/// As read_trajectory, with the time that it takes on the terminal.
Trajectory read_motion(const std::string& file, const Model& model);

}  // namespace counterpoint::apps
