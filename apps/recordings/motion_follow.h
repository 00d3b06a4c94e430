// A recording explained row by row while it is still written: a CSV file that grows, or standard
// input.
#pragma once

#include <string>

#include "counterpoint/engine/estimate/motion_follower.h"

namespace counterpoint::apps {

struct FollowedFiles {
  std::string recording;                 ///< CSV; "-": standard input
  std::string output, contacts, forces;  ///< CSV tables to write, each row as it is known; or empty
  double idle = 5.0;                     ///< a file that has not grown for so long has ended [s]
};

struct FollowedFigures {
  long rows = 0, told = 0;
  double unexplained_mean = 0.0, unexplained_max = 0.0;  ///< weights of the trees
  bool stopped = false;                                  ///< by Ctrl-C
  estimation::RecordingErrors errors = estimation::RecordingErrors::kWhite;
};

/// Reads to the end of the input or until Ctrl-C; what was written stays. @throws InputError naming
/// the recording and its line.
FollowedFigures follow_motion(const FollowedFiles& files, const Scene& scene,
                              const estimation::ColumnMap& map,
                              const estimation::FollowOptions& options);

}  // namespace counterpoint::apps
