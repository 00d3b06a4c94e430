// Reading of motions and recordings in commands.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/trajectory.h"
#include "recordings/estimation.h"

namespace counterpoint::apps {

/// Reads a trajectory as read_trajectory does and shows the elapsed time on the terminal.
Trajectory read_motion(const std::string& file, const Model& model);

/// Reads recordings as estimation::read_all does and prints its notes on assumptions to standard
/// error.
std::vector<Recording> read_with_notes(const std::vector<std::string>& files, const ColumnMap& map,
                                       const Scene& scene);

}  // namespace counterpoint::apps
