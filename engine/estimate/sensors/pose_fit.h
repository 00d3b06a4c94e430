// Inverse kinematics: configurations from position sensors, row by row.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

struct FittedPoses {
  std::vector<VectorX> frames;  ///< nq; one per row
  MatrixX seen;                 ///< nv x rows: 1 where sensors determine a coordinate, otherwise 0
};

/// Finds for each frame the configuration with the least weighted squared residuals of points,
/// orientations and coordinates. The search starts at the previous frame; in the first one,
/// floating trees are placed by their points (Umeyama, IEEE PAMI 13(4), 1991). Coordinates that no
/// sensor determines in a row are interpolated between rows.
/// @param frames  start of each row (nq); coordinates with `recorded` (nv) equal to 1 are fixed
FittedPoses fit_poses(const Model& model, const std::vector<SensorTerm>& sensors, double start,
                      double h, const std::vector<VectorX>& frames, const VectorX& recorded);

/// Interpolates coordinates with `seen` (nv x rows) equal to 0 between the rows around them.
void fill_gaps(const Model& model, const MatrixX& seen, std::vector<VectorX>& frames);

}  // namespace counterpoint::estimation
