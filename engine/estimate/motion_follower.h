// Online version of motion_estimate.h for a recording in progress: a window of the newest rows is
// estimated, and each row is reported with a fixed lag (docs/explanation/explaining.md, Row by
// row).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

struct FollowOptions {
  int window = 30;  ///< rows estimated together, more than `lag` + 3
  int lag = 10;     ///< a row is reported once this number of rows has followed it
  int steps = 2;    ///< Gauss-Newton steps per row
  int threads = 1;  ///< 0: one per core; the result does not depend on it
  /// Kind of errors; if absent, it is determined from the first rows.
  std::optional<RecordingErrors> errors;
  /// Sums to report besides those of each link.
  std::vector<ContactSum> sums;
};

/// Estimates the motion row by row. Noise, interval and kind of errors come from the first
/// `kFollowedRows` rows, which are therefore reported late. Memory and time per row are constant.
class MotionFollower {
 public:
  /// @throws InputError if the window is shorter than `lag` + 4, no position is mapped, or the map
  /// has sensors.
  MotionFollower(const Scene& scene, const ColumnMap& map, const FollowOptions& options = {});
  ~MotionFollower();

  /// Adds a row: time [s], q (nq; a joint with a non-finite component counts as not measured),
  /// joint forces (nv, or empty) [N, N m]. Returns the rows that are now complete: usually one,
  /// none or many at the start. Standard deviations of forces are not computed (NaN). After a gap
  /// longer than the window the estimate restarts.
  /// @throws InputError if time does not increase or a size is wrong.
  MotionEstimate push(double time, const VectorX& q, const VectorX& force = {});
  /// Returns the remaining rows. The next row pushed starts a new motion.
  MotionEstimate finish();

  /// Kind of errors; white until the first rows have been judged.
  RecordingErrors errors() const;
  const std::vector<ContactSum>& sums() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};
inline constexpr int kFollowedRows = 50;

}  // namespace counterpoint::estimation
