// How sure a motion estimate is of each thing before it has seen the whole: standard deviations.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

/// A geometry whose place in its link is not known exactly.
struct UnsureGeometry {
  int geometry = 0;
  Vector3 direction;  ///< towards what it touches, of unit length, in its own axes
};

/// All standard deviations; infinity where nothing is known.
struct MotionPriors {
  VectorX position;            ///< nv: of the recorded positions [m, rad]
  double cutoff = 0.0;         ///< of the low-pass behind measured accelerations [Hz]; 0: none
  VectorX acceleration;        ///< nv: of measured accelerations [m/s^2, rad/s^2]
  VectorX force;               ///< nv: of measured joint forces [N, N m]
  double unexplained = 0.02;   ///< forces where no motor is [weights of the tree]
  VectorX size;                ///< nv: forces of motors [N, N m]
  VectorX change;              ///< nv: their change in an interval [N, N m]
  std::vector<UnsureGeometry> geometries;
  double place = 0.02;         ///< of those, along their direction [m]
  double smoothing_start = 1e-2, smoothing_end = 1e-3;  ///< of the contact law [m]
};

/// nv: are positions recorded? Of a rotation all of it.
std::vector<char> recorded_coordinates(const Model& model, const ColumnMap& map);

/// Geometries that come within `reach` [m] of the world in more than a tenth of the frames.
std::vector<UnsureGeometry> unsure_geometries(const MotionProblem& problem,
                                              const std::vector<VectorX>& frames, double reach);

/// What the recording itself and the scene say of all deviations.
MotionPriors choose_priors(const Scene& scene, const Recording& recording,
                           const std::vector<char>& recorded);

/// Priors as the estimate found them.
void update_priors(const Model& model, const MotionProblem& problem, MotionFit& fit,
                   MotionPriors& priors);

/// Frames to begin with: the recording without spikes, through a low-pass.
std::vector<VectorX> start_frames(const MotionProblem& problem, const MotionPriors& priors);

/// The problem of a recording of evenly spaced rows, with `priors`.
MotionProblem motion_problem(const Scene& scene, const Recording& recording,
                             const MotionPriors& priors);

}  // namespace counterpoint::estimation
