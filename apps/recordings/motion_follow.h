// Explains a recording row by row while it is still being written, from a growing CSV file or
// standard input.
#pragma once

#include <string>

#include "counterpoint/engine/estimate/motion_follower.h"

namespace counterpoint::apps {

struct FollowedFiles {
  std::string recording;                 ///< CSV file; "-" is standard input
  std::string output, contacts, forces;  ///< CSV tables to write row by row; empty: not written
  double idle = 5.0;                     ///< a file that has not grown for this long has ended [s]
};

struct FollowedMetrics {
  long rows = 0, told = 0;
  double unexplained_mean = 0.0, unexplained_max = 0.0;  ///< [weights of the trees]
  bool stopped = false;                                  ///< ended by Ctrl-C
  estimation::RecordingErrors errors = estimation::RecordingErrors::kWhite;
};

/// Reads to the end of the input or until Ctrl-C; rows written so far stay in the files. @throws
/// InputError naming the recording and the line.
FollowedMetrics follow_motion(const FollowedFiles& files, const Scene& scene,
                              const estimation::ColumnMap& map,
                              const estimation::FollowOptions& options);

}  // namespace counterpoint::apps
