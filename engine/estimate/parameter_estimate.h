// Parameters of a scene from recordings whose motions are unknown too; the method is described in
// docs/explanation/explaining.md.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Estimated parameters, and the motions that were estimated with them.
struct ParameterEstimate {
  /// Values with 95 % intervals; no interval for a parameter that the motions do not determine
  /// better than its prior, and much better than the range between its bounds, which is the
  /// standard deviation of a prior that has none stated. Costs are half sums of squared
  /// residuals over their standard deviations (Cauchy loss); evaluations are Newton steps.
  Fit parameters;
  /// Unknown constants of the sensors, which the recordings share (sensor.h).
  std::vector<EstimatedParameter> constants;
  std::vector<std::vector<double>> times;     ///< row times of each recording [s]
  std::vector<std::vector<VectorX>> motions;  ///< nq; the configuration of each recording at each
                                              ///< row
  VectorX cost_ratio;      ///< per recording: mean square of residuals over their variance
  double smoothing = 0.0;  ///< smoothing of the contact law at the end [m]
};

/// Estimates the most probable parameters and motions of recordings that share the parameters.
/// Errors must be white; rows that are not evenly spaced are interpolated. Parameters start at the
/// scene's values. Sensors of the map are measurements, too, but for those of contact forces and
/// wrenches; their unknown constants are the same in all recordings. Uses `threads` and `stop` of
/// the options; the result does not depend on the number of threads.
/// @throws InputError for a kind of parameter that cannot be found this way (sizes, restitution and
/// parameters of the contact law, which the search itself changes), and as estimate_motion.
ParameterEstimate estimate_parameters(const Scene& scene, const ColumnMap& map,
                                      const std::vector<const Recording*>& recordings,
                                      const std::vector<Parameter>& parameters,
                                      const MotionEstimateOptions& options = {});

}  // namespace counterpoint::estimation
