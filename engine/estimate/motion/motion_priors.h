// Prior knowledge of a motion estimate, as standard deviations.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"

namespace counterpoint::estimation {

/// A geometry whose position in its link is uncertain.
struct UnsureGeometry {
  int geometry = 0;
  Vector3 direction;  ///< unit vector of the uncertain direction, in axes of the geometry
};

/// Standard deviations; infinity where nothing is known.
struct MotionPriors {
  VectorX position;          ///< nv: of the recorded positions [m, rad]
  double cutoff = 0.0;       ///< low-pass cutoff of the measured accelerations [Hz]; 0: none
  VectorX acceleration;      ///< nv: of measured accelerations [m/s^2, rad/s^2]
  double loss_scale = 0.0;   ///< MotionProblem::loss_scale
  VectorX force;             ///< nv: of measured joint forces [N, N m]
  double unexplained = 0.0;  ///< forces without a motor [weights of the tree]
  VectorX size;              ///< nv: forces of motors [N, N m]
  VectorX change;            ///< nv: change of motor forces over one interval [N, N m]
  std::vector<UnsureGeometry> geometries;
  double place = 0.0;                    ///< offset of these geometries along `direction` [m]
  double place_drift = 0.0;              ///< drift of these offsets over a recording [m]
  std::vector<double> smoothing_starts;  ///< smoothing of the contact law [m]; the start with the
                                         ///< best result is kept
  double smoothing_end = 0.0;            ///< [m]
};

/// Priors for white errors: positions have the standard deviation of their noise.
MotionPriors white_priors(const Scene& scene, const ColumnMap& map, const RecordedMotion& recorded);
/// Priors for slow errors: low-passed accelerations are trusted more than positions, and geometries
/// that touch the ground have uncertain positions in their links.
MotionPriors slow_priors(const Scene& scene, const ColumnMap& map, const RecordedMotion& recorded);

MotionProblem motion_problem(const Scene& scene, const RecordedMotion& recorded,
                             const MotionPriors& priors);

}  // namespace counterpoint::estimation
