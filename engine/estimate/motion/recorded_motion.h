// A recording prepared for estimation: evenly spaced frames, with marks for measured and damaged
// values.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/sensors/sensor_terms.h"

namespace counterpoint::estimation {

/// Rows are evenly spaced if their intervals differ by less than this fraction.
inline constexpr double kUneven = 0.02;
/// A row of the even grid counts as measured if the recorded rows on both sides of it are at most
/// this number of intervals apart.
inline constexpr double kGap = 1.5;

struct RecordedMotion {
  std::vector<double> time;     ///< evenly spaced [s]
  std::vector<VectorX> frames;  ///< nq; one per row, interpolated where nothing was measured
  MatrixX measured;             ///< nv x rows: 1 where a position was measured, else 0
  VectorX by_sensors;           ///< nv: 1 where only sensors measure it, otherwise 0
  SensorTerms sensors;
  MatrixX force;                ///< nv x rows: recorded joint forces [N, N m]
  VectorX noise;                ///< nv: standard deviation of white noise [m, rad]
  std::vector<Outlier> spikes;  ///< values that were rejected
  bool resampled = false;       ///< the recording's rows are not evenly spaced

  int rows() const { return static_cast<int>(frames.size()); }
  double h() const { return (time.back() - time.front()) / (rows() - 1); }
};

/// Marks the coordinates (nv) with a recorded position; an orientation if any component is
/// recorded.
std::vector<char> recorded_coordinates(const Model& model, const ColumnMap& map);

/// Given standard deviations (nv), infinity where none is given.
VectorX given(const VectorX& deviation, int nv);

/// Prepares a recording. @throws InputError if it has fewer than kLeastRows rows, or no position.
RecordedMotion prepare(const Model& model, const ColumnMap& map, const Recording& recording);

/// Returns rows `first` ... `first` + `count` - 1.
RecordedMotion part(const RecordedMotion& whole, int first, int count);

}  // namespace counterpoint::estimation
