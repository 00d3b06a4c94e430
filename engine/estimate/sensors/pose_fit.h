// Configurations from sensors that tell positions: inverse kinematics, row by row.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

struct FittedPoses {
  std::vector<VectorX> frames;  ///< one a row: nq
  MatrixX seen;                 ///< nv x rows: 1 where sensors tell a coordinate, else 0
};

/// The configurations, frame by frame, that are nearest to points, orientations and coordinates in
/// the least squares of their deviations. Each search starts at the frame before; the first one
/// places what floats by its points (Umeyama, IEEE PAMI 13(4), 1991). Coordinates that no sensor
/// sees in a row are interpolated between rows.
/// @param frames  start of each row (nq); held are the coordinates that `recorded` (nv) names by 1
FittedPoses fit_poses(const Model& model, const std::vector<SensorTerm>& sensors, double start,
                      double h, const std::vector<VectorX>& frames, const VectorX& recorded);

/// Interpolates each coordinate where `seen` (nv x rows) is 0 between the rows where it is not.
void fill_gaps(const Model& model, const MatrixX& seen, std::vector<VectorX>& frames);

}  // namespace counterpoint::estimation
