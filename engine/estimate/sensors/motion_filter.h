// Recorded motions made smooth, and how noisy they are.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::estimation {

/// configuration_difference (nv), and q (+) by (nq).
VectorX difference(const Model& model, const VectorX& from, const VectorX& to);
VectorX moved(const Model& model, const VectorX& q, const VectorX& by);

/// Differences of neighbouring frames (nv x frames - 1).
MatrixX steps_of(const Model& model, const std::vector<VectorX>& frames);

/// Frames through a Gaussian low-pass of this half-power frequency [Hz]; beyond its ends a motion
/// goes on as its point reflection. h: interval between frames [s].
std::vector<VectorX> low_pass(const Model& model, const std::vector<VectorX>& frames, double h,
                              double frequency);

/// Frames on either side that the low-pass takes in.
int low_pass_reach(double frequency, double h);

/// Standard deviation of white noise in each coordinate (nv) [m, rad]: from a quantile of third
/// differences, in which a smooth motion leaves little and an impact leaves a few outliers; or the
/// least that differences of the orders from three to `order` tell, where rows are so far apart
/// that the motion itself bends between them.
VectorX white_noise(const Model& model, const std::vector<VectorX>& frames, int order = 3);

/// nv x frames: second differences over h squared [m/s^2, rad/s^2]; zero at both ends.
MatrixX accelerations(const Model& model, const std::vector<VectorX>& frames, double h);

}  // namespace counterpoint::estimation
