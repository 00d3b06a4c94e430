// Figures of a scene from recordings whose motions are unknown too: how is in
// docs/explanation/explaining.md.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Figures, and the motions that were found with them.
struct FigureEstimate {
  /// Values with 95 % intervals, none where the motions do not show a figure: it is within its
  /// prior, the range between its bounds. Costs are half sums of squares over standard deviations
  /// (Cauchy's loss), evaluations are Newton steps.
  Fit figures;
  std::vector<std::vector<double>> times;     ///< times of each recording's rows [s]
  std::vector<std::vector<VectorX>> motions;  ///< configurations of each recording, one a row: nq
  VectorX cost_ratio;      ///< by recording: mean square of measurements over their variance
  double smoothing = 0.0;  ///< contact law at the end [m]
};

/// The most probable figures and motions of recordings that have the figures in common, each with
/// evenly spaced rows and white errors. Figures start where the scene has them. Takes
/// MotionEstimateOptions::threads and ::stop. The result does not depend on the number of threads.
/// @throws InputError for a kind of parameter that a motion cannot show (sizes, and what the search
/// changes itself: restitution and the figures of the contact law), and where estimate_motion does.
FigureEstimate estimate_figures(const Scene& scene, const ColumnMap& map,
                                const std::vector<const Recording*>& recordings,
                                const std::vector<Parameter>& parameters,
                                const MotionEstimateOptions& options = {});

}  // namespace counterpoint::estimation
