// The motion behind a recording that is still going on, and the forces behind the motion: a window
// of its newest rows is explained, and each row told once it is some rows old
// (docs/explanation/explaining.md, Row by row).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

struct FollowOptions {
  int window = 30;  ///< rows explained together, more than `lag` + 3
  int lag = 10;     ///< a row is told once so many rows have followed it
  int steps = 2;    ///< Gauss-Newton steps a row
  int threads = 1;  ///< 0: one a core; the result does not depend on it
  /// None: found from the first rows.
  std::optional<RecordingErrors> errors;
  /// Sums to be told beside those of each link.
  std::vector<ContactSum> sums;
};

/// Explains rows as they come. Noise, interval and kind of errors are judged by the first
/// `kFollowedRows` rows, which are told late; memory and time a row do not grow.
class MotionFollower {
 public:
  /// @throws InputError where the window is shorter than `lag` + 4, no position is mapped, or the
  /// map has sensors.
  MotionFollower(const Scene& scene, const ColumnMap& map, const FollowOptions& options = {});
  ~MotionFollower();

  /// A recorded row: time [s], q (nq; a joint with a component that is not finite was not
  /// measured), forces of joints (nv, or empty) [N, N m]. Rows that are known now: none, most often
  /// one, many at the start. Their deviations of forces are not computed (NaN). Behind a gap longer
  /// than the window it begins anew. @throws InputError where time does not rise or a size is
  /// wrong.
  MotionEstimate push(double time, const VectorX& q, const VectorX& force = {});
  /// The rows that are left. The next row pushed begins a new motion.
  MotionEstimate finish();

  /// White until the first rows have been judged.
  RecordingErrors errors() const;
  const std::vector<ContactSum>& sums() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};
inline constexpr int kFollowedRows = 50;

}  // namespace counterpoint::estimation
