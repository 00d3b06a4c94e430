// Estimation of white noise in a series from high-order differences.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint::estimation {

/// Returns the standard deviation of white noise in a series with these steps from value to value:
/// from a quantile of third differences, in which smooth motions leave little and impacts leave few
/// outliers, or the smallest estimate from differences of orders three to `order`. NaN steps are
/// missing. Returns 0 if there are too few.
double series_noise(VectorX steps, int order = 3);

}  // namespace counterpoint::estimation
