// A reference to be tracked: targets of a term over time, from the rows of a table
// (docs/reference/optimization-format.md#targets-from-a-file).
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Values of a quantity over time.
struct Samples {
  std::vector<double> time;  ///< [s], ascending, at least one
  /// Rows of the target (kConfiguration: nq; kOrientation: 4, unit quaternions w x y z) x times.
  /// A position or orientation that contains NaN is unknown.
  MatrixX values;
};

inline Quaternion quaternion_of(const VectorRef& wxyz) {
  return Quaternion(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
}

/// Replay of samples.
struct Playback {
  double start = 0.0;  ///< time of the samples at time 0 of the problem [s]
  double rate = 1.0;   ///< seconds of the samples in a second of the problem
  /// The samples repeat: the last one is the first of the next cycle, moved on by the distance that
  /// positions cover in a cycle.
  bool loop = false;
};

/// Returns true if targets of this quantity may change over time.
bool may_follow(Quantity quantity);
/// Number of entries of a target: rows_of, nq for kConfiguration, 4 for kOrientation.
int target_size(const Model& model, Quantity quantity);

class Reference {
 public:
  /// mirrored: the samples' mirror image, or null. It replaces the samples; in a loop it follows
  /// them, so that every other cycle is mirrored. The model must outlive the reference.
  /// @throws InputError if sizes do not fit, or times do not rise.
  Reference(const Model& model, Quantity quantity, const Samples& samples, const Playback& playback,
            const MatrixX* mirrored = nullptr);

  /// Writes the target at a time of the problem [s], interpolated between samples: rotations turn
  /// at constant speed. Before the first sample and beyond the last one positions are held, and
  /// velocities are zero. Unknown between two samples of which one is unknown. Does not allocate if
  /// `out` has the size of a target.
  void sample(double time, VectorX& out) const;

 private:
  void append(const MatrixX& values, const std::vector<double>& time);
  void find_differences();

  const Model* model_;
  Quantity quantity_;
  Playback playback_;
  Samples samples_;
  MatrixX difference_;  ///< from each sample to the next: rows of the tangent space x (times - 1)
  VectorX moves_;    ///< 1 for rows that are positions in the world, which a loop moves on; else 0
  VectorX advance_;  ///< distance of a cycle, one entry a row [m]
};

/// Sets the targets of all terms with a reference to those of a motion that starts at `time` [s].
/// Does not allocate after the first call.
void set_targets(Problem& problem, double time);

}  // namespace counterpoint::optimization
