// Statistics of the difference between prediction and recording, by coordinate.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/model/spatial.h"

namespace counterpoint::apps {

/// Forces [N or N m] or velocities [m/s or rad/s].
struct CoordinateFigures {
  std::string name;   ///< as in a trajectory, NAME.u or NAME.v
  double rms = 0.0;   ///< root of the mean square of the difference
  double mean = 0.0;  ///< predicted (recovered) less recorded
  /// Of what was recorded about its mean, and R2 = 1 - (rms / deviation)^2; none where nothing was
  /// recorded or it never changed.
  std::optional<double> recorded_deviation, r2;
};

/// @param difference  predicted less recorded, one or more
/// @param recorded    as many
CoordinateFigures coordinate_figures(const std::string& name, const VectorX& difference,
                                     const VectorX& recorded);

}  // namespace counterpoint::apps
