// Tables of estimated motions: the trajectory, its contacts, its forces
// (docs/reference/recording-format.md, Tables of `explain`).
#pragma once

#include <string>
#include <vector>

#include "recordings/estimation.h"

namespace counterpoint::apps {

/// Recordings and their estimates, in the same order.
struct ExplainedMotions {
  const Scene& scene;
  const ColumnMap& map;
  const std::vector<Recording>& recordings;
  const std::vector<MotionEstimate>& estimates;
};

/// Returns FILE, or if there are several recordings FILE with the number of this one, from 1,
/// before its ending: motion.csv, motion_2.csv.
std::string numbered_file(const std::string& file, std::size_t index, std::size_t count);

/// Writes a trajectory with the motor forces, in the format that `view` reads: from the first row
/// to the last whose motion was found. The first row repeats the forces of the second. There is no
/// state_hash, since the velocities are means over steps and the motion is not one of the engine to
/// the bit. @throws InputError if the file cannot be written.
void write_motion_table(const std::string& file, const Model& model,
                        const MotionEstimate& estimate);

/// Writes one row per time and pair of geometries with a force above 1e-6 of the weight; with
/// several recordings the first column names the recording. @throws InputError as above.
void write_contact_table(const std::string& file, const ExplainedMotions& motions);

/// Writes one row per time: generalized forces and sums of contact forces. @throws InputError as
/// above.
void write_force_table(const std::string& file, const ExplainedMotions& motions);

}  // namespace counterpoint::apps
