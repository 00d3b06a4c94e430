// Recorded motions made smooth, and how noisy they are.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::estimation {

/// Frames through a Gaussian low-pass of this half-power frequency [Hz]; beyond its ends a motion
/// goes on as its point reflection. h: interval between frames [s].
std::vector<VectorX> low_pass(const Model& model, const std::vector<VectorX>& frames, double h,
                              double frequency);

/// Frames in which coordinates that are farther than `distance` (nv) [m, rad] from the median of the
/// five frames around them are set to it.
std::vector<VectorX> without_spikes(const Model& model, const std::vector<VectorX>& frames,
                                    const VectorX& distance);

/// Standard deviation of white noise in each coordinate (nv) [m, rad]: from the median of third
/// differences, in which a motion of 100 Hz leaves little and an impact leaves a few outliers.
VectorX white_noise(const Model& model, const std::vector<VectorX>& frames);

/// nv x frames: second differences over h squared [m/s^2, rad/s^2]; zero at both ends.
MatrixX accelerations(const Model& model, const std::vector<VectorX>& frames, double h);

}  // namespace counterpoint::estimation
