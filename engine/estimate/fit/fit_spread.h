// How well a fit knows its parameters.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/fit/fit_system.h"

namespace counterpoint::estimation::fitting {

/// The median of |t| with so many degrees of freedom that 95 % do not exceed.
double student_95(double degrees);

/// Covariance of the shares, and for which parameters it means anything.
struct Spread {
  MatrixX covariance;
  std::vector<char> known;
  double quantile = 0.0;
};

/// From derivatives at the solution. Residuals of one recording hang together, so a recording is
/// the unit: inv(H) (sum g g') inv(H) n / (n - p), g the gradient of a recording, H = J'J. Of a
/// single one: the variance of the residuals times inv(H), as if they were independent.
Spread spread(const System& system, const VectorX& at);

}  // namespace counterpoint::estimation::fitting
