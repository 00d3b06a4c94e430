// A recording made ready to be explained: evenly spaced frames, which values were measured, and
// which are damaged.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/sensors/sensor_terms.h"

namespace counterpoint::estimation {

/// Rows are evenly spaced whose intervals differ by less than this share.
inline constexpr double kUneven = 0.02;
/// A row of the even grid was measured that has recorded rows on both sides within so many
/// intervals.
inline constexpr double kGap = 1.5;

struct RecordedMotion {
  std::vector<double> time;     ///< evenly spaced [s]
  std::vector<VectorX> frames;  ///< one a row: nq; interpolated where nothing was measured
  MatrixX measured;             ///< nv x rows: 1 where a position was measured, else 0
  VectorX by_sensors;           ///< nv: 1 where sensors tell it, 0 where columns do
  SensorTerms sensors;
  MatrixX force;                ///< nv x rows: recorded forces of joints [N, N m]
  VectorX noise;                ///< nv: standard deviation of white noise [m, rad]
  std::vector<Outlier> spikes;  ///< values that were left out
  bool resampled = false;       ///< the recording's rows are not evenly spaced

  int rows() const { return static_cast<int>(frames.size()); }
  double h() const { return (time.back() - time.front()) / (rows() - 1); }
};

/// nv: are positions recorded? An orientation is if any of its components is.
std::vector<char> recorded_coordinates(const Model& model, const ColumnMap& map);

/// Standard deviations that a map gives: nv, infinity where it gives none.
VectorX given(const VectorX& deviation, int nv);

/// @throws InputError where a recording has fewer than kLeastRows rows, or no position.
RecordedMotion prepare(const Model& model, const ColumnMap& map, const Recording& recording);

/// Rows `first` ... `first` + `count` - 1.
RecordedMotion part(const RecordedMotion& whole, int first, int count);

}  // namespace counterpoint::estimation
