// Motions that commands read, and recordings of them.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "recordings/estimation.h"

namespace counterpoint::apps {

/// As read_trajectory, with the time that it takes on the terminal.
Trajectory read_motion(const std::string& file, const Model& model);

/// As estimation::read_all; standard error has what it took for granted.
std::vector<Recording> read_with_notes(const std::vector<std::string>& files, const ColumnMap& map,
                                       const Scene& scene);

}  // namespace counterpoint::apps
