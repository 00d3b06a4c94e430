// Tables of estimated motions: the motion as a trajectory, its contacts, its forces
// (docs/reference/recording-format.md, Tables of `explain`).
#pragma once

#include <string>
#include <vector>

#include "recordings/estimation.h"

namespace counterpoint::apps {

/// Estimates of some recordings, in their order.
struct ExplainedMotions {
  const Scene& scene;
  const ColumnMap& map;
  const std::vector<Recording>& recordings;
  const std::vector<MotionEstimate>& estimates;
};

/// FILE, or where there are several recordings FILE with the number of this one, from 1, before its
/// ending: motion.csv, motion_2.csv.
std::string numbered_file(const std::string& file, std::size_t index, std::size_t count);

/// A trajectory with the forces of motors, as `view` reads it: rows from the first to the last
/// whose motion was found. The forces of its first row are those of its second. It has no
/// state_hash: its velocities are means, so that it is no motion of the engine to the bit. @throws
/// InputError where the file cannot be written.
void write_motion_table(const std::string& file, const Model& model,
                        const MotionEstimate& estimate);

/// A row a time and pair of geometries that push by more than 1e-6 of the weight; of several
/// recordings the first column names the recording. @throws InputError as above.
void write_contact_table(const std::string& file, const ExplainedMotions& motions);

/// A row a time: forces of coordinates, and sums of contact forces. @throws InputError as above.
void write_force_table(const std::string& file, const ExplainedMotions& motions);

}  // namespace counterpoint::apps
