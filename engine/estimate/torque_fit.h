// Parameters of arms and other mechanisms from recorded joint forces, where nothing is touched:
// inverse dynamics is linear in most of them (Atkeson, An and Hollerbach, "Estimation of Inertial
// Parameters of Manipulator Loads and Links", IJRR 1986).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

struct TorqueFitOptions {
  /// Recorded and modelled forces are compared after the same low-pass filter (Gaussian, -3 dB at
  /// this frequency [Hz]), at rows half a period of it apart. Motions are filtered at three times
  /// that frequency before they are differentiated.
  double cutoff = 10.0;
  /// Below this speed [rad/s, m/s] a joint with dry friction is at rest: its friction is whatever
  /// balances the recorded force, within its bounds. Such rows are not fitted.
  double rest_speed = 0.0;
  int threads = 1;                  ///< 0: one per core; the result does not depend on it
  std::function<bool()> stop = {};  ///< true ends the fit with the best parameters so far
};

/// A joint whose force was recorded.
struct TorqueChannel {
  int coordinate = 0;      ///< index into v
  int rows = 0;            ///< compared rows, without those at rest
  double deviation = 0.0;  ///< standard deviation of the residuals [N, N m]
  /// Variance of a mean of rows over that of independent rows: 1 for white errors.
  double correlation = 1.0;
};

struct TorqueFit {
  /// Values with 95 % intervals; none for parameters that are not told (kTold). Costs are sums of
  /// squared residuals over the variances at the end.
  Fit parameters;
  std::vector<TorqueChannel> channels;
  /// Inertial parameters of the bodies that have any among the parameters, ten for each, and their
  /// covariance.
  std::vector<int> bodies;
  VectorX inertial;
  MatrixX inertial_covariance;
};

/// Fits masses, centres of mass, shears, spreads, inertias, damping, dry friction, armatures,
/// gravity, and offsets, gains and delays of the recorded forces. The priors are the scene's
/// values, with the stated standard deviation or the range between the bounds. @throws InputError
/// for other parameters, a model with quaternions or closures, a recording without forces, with
/// uneven rows, or during which something touches.
TorqueFit fit_torques(const Scene& scene, const ColumnMap& map,
                      const std::vector<const Recording*>& recordings,
                      const std::vector<Parameter>& parameters, const TorqueFitOptions& options);

/// Agreement of recorded forces with those of a scene.
struct TorqueScore {
  std::vector<CoordinateMetrics> coordinates;  ///< one for each channel
  /// Recorded and predicted forces of each channel at the compared rows of all recordings, after
  /// the filter [N, N m].
  std::vector<VectorX> recorded, predicted;
  /// Largest force of each channel that friction had to balance while the joint rested [N, N m].
  VectorX held;
};

/// Compares recorded forces with those of the scene and of channel parameters (offset, gain, delay)
/// of these values, filtered as in a fit. Friction at rest balances the force, up to the dry
/// friction or, if that is larger, `held`: TorqueScore::held of other recordings; empty: of these.
/// @throws InputError as fit_torques.
TorqueScore score_torques(const Scene& scene, const ColumnMap& map,
                          const std::vector<const Recording*>& recordings,
                          const std::vector<Parameter>& parameters, const VectorX& values,
                          const TorqueFitOptions& options, const VectorX& held = {});

}  // namespace counterpoint::estimation
