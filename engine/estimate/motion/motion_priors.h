// How sure a motion estimate is of each thing before it has seen the whole: standard deviations.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"

namespace counterpoint::estimation {

/// A geometry whose place in its link is not known exactly.
struct UnsureGeometry {
  int geometry = 0;
  Vector3 direction;  ///< along which it may lie elsewhere, of unit length, in its own axes
};

/// Standard deviations; infinity where nothing is known.
struct MotionPriors {
  VectorX position;          ///< nv: of the recorded positions [m, rad]
  double cutoff = 0.0;       ///< low-pass behind measured accelerations [Hz]; 0: none
  VectorX acceleration;      ///< nv: of measured accelerations [m/s^2, rad/s^2]
  double loss_scale = 0.0;   ///< MotionProblem::loss_scale
  VectorX force;             ///< nv: of measured joint forces [N, N m]
  double unexplained = 0.0;  ///< forces where no motor is [weights of the tree]
  VectorX size;              ///< nv: forces of motors [N, N m]
  VectorX change;            ///< nv: their change in an interval [N, N m]
  std::vector<UnsureGeometry> geometries;
  double place = 0.0;                    ///< their places, along `direction` [m]
  double place_drift = 0.0;              ///< changes of these in a recording [m]
  std::vector<double> smoothing_starts;  ///< contact law [m]: the best start is taken
  double smoothing_end = 0.0;            ///< [m]
};

/// For recordings whose errors are white: positions are as sure as their noise says.
MotionPriors white_priors(const Scene& scene, const ColumnMap& map, const RecordedMotion& recorded);
/// For recordings whose errors are slow: their low-passed accelerations are trusted more than their
/// positions, and the places of what touches the ground in its link are unsure.
MotionPriors slow_priors(const Scene& scene, const ColumnMap& map, const RecordedMotion& recorded);

MotionProblem motion_problem(const Scene& scene, const RecordedMotion& recorded,
                             const MotionPriors& priors);

}  // namespace counterpoint::estimation
