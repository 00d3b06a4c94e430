// Low-pass filtering of recorded motions, and estimation of their noise.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::estimation {

/// configuration_difference (nv), and integrate_configuration (nq), which return their results.
VectorX difference(const Model& model, const VectorX& from, const VectorX& to);
VectorX moved(const Model& model, const VectorX& q, const VectorX& by);

/// Configuration differences of neighbouring frames (nv x frames - 1).
MatrixX steps_of(const Model& model, const std::vector<VectorX>& frames);

/// Filters frames with a Gaussian low-pass of this half-power frequency [Hz]. Beyond its ends a
/// motion is continued by point reflection. h: interval between frames [s].
std::vector<VectorX> low_pass(const Model& model, const std::vector<VectorX>& frames, double h,
                              double frequency);

/// Number of frames on either side within the low-pass window.
int low_pass_reach(double frequency, double h);

/// Standard deviation of white noise per coordinate (nv) [m, rad], from a quantile of third
/// differences, in which smooth motions leave little and impacts leave few outliers. With `order` >
/// 3: the smallest estimate from differences of orders three to `order`, for rows so far apart that
/// the motion itself bends between them.
VectorX white_noise(const Model& model, const std::vector<VectorX>& frames, int order = 3);

/// Accelerations (nv x frames) from second differences [m/s^2, rad/s^2]; zero at both ends.
MatrixX accelerations(const Model& model, const std::vector<VectorX>& frames, double h);

}  // namespace counterpoint::estimation
