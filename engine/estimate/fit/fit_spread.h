// Uncertainty of the parameters of a fit.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/fit/fit_system.h"

namespace counterpoint::estimation::fitting {

/// Two-sided 95 % quantile of Student's t distribution: 95 % of |t| lie
/// below it.
double student_95(double degrees);

/// Covariance of the scaled parameters, valid where `known`, and the quantile for its intervals.
struct Spread {
  MatrixX covariance;
  std::vector<char> known;
  double quantile = 0.0;
  MatrixX information;  ///< J'J over the variance of the residuals, as the covariance has it in the
                        ///< mean over the parameters
  MatrixX by_recording;  ///< its diagonal by recording
};

/// Computes the covariance from derivatives at the solution. Residuals within a recording are
/// correlated, so a recording is the unit of a sandwich estimate:
/// inv(H) (sum g g') inv(H) n / (n - p), g the gradient of a recording, H = J'J. If there are no
/// more recordings than parameters: the variance of the residuals times inv(H), as if residuals
/// were independent.
Spread spread(const System& system, const VectorX& at);

/// Inverse square of the standard deviation of a prior, in a search coordinate. deviation: of the
/// value, about `mean`, if it is stated; range: between the bounds of the coordinate, the standard
/// deviation otherwise.
double prior_weight(std::optional<double> deviation, double mean, bool logarithmic, double range);
/// Whether recordings tell a coordinate of this variance (with its prior): without its own prior
/// its standard deviation is at most kTold of its range, and below that of the prior. prior:
/// prior_weight.
bool is_told(double variance, double prior, double range);

/// A parameter at the end of a fit, whose search coordinate is its value or the logarithm of it.
struct EndPoint {
  double value = 0.0, coordinate = 0.0;
  double lower = 0.0, upper = 0.0;  ///< bounds of the value
  bool logarithmic = false;
  bool told = false;  ///< it gets an interval
};
/// Appends the parameters with 95 % intervals within their bounds, and sets the correlations.
/// covariance: of the coordinates; quantile: of its intervals.
void set_parameters(const std::vector<EndPoint>& ends, const MatrixX& covariance, double quantile,
                    Fit& out);

}  // namespace counterpoint::estimation::fitting
