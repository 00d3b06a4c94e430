// White noise in a series, from its differences of high order.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint::estimation {

/// Standard deviation of white noise in a series whose steps from value to value these are: from a
/// quantile of third differences, in which a smooth motion leaves little and an impact leaves a few
/// outliers, or the least that differences of the orders from three to `order` tell. Steps that are
/// NaN are missing; 0 where there are too few.
double series_noise(VectorX steps, int order = 3);

}  // namespace counterpoint::estimation
