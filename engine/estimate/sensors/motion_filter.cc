#include "counterpoint/engine/estimate/sensors/motion_filter.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/series_noise.h"

namespace counterpoint::estimation {
namespace {

/// A Gaussian of standard deviation kHalfPower / f [s] has half the power at frequency f [Hz];
/// kHalfPower = sqrt(ln 2) / (2 pi).
constexpr double kHalfPower = 0.13251;
/// The Gaussian is cut off at this number of standard deviations.
constexpr double kCutOff = 4.0;

}  // namespace

VectorX difference(const Model& model, const VectorX& from, const VectorX& to) {
  VectorX out(model.nv());
  configuration_difference(model, from, to, out);
  return out;
}

VectorX moved(const Model& model, const VectorX& q, const VectorX& by) {
  VectorX out(q.size());
  integrate_configuration(model, q, by, 1.0, out);
  return out;
}

MatrixX steps_of(const Model& model, const std::vector<VectorX>& frames) {
  MatrixX out(model.nv(), static_cast<Eigen::Index>(frames.size()) - 1);
  for (Eigen::Index k = 0; k < out.cols(); ++k)
    out.col(k) = difference(model, frames[static_cast<std::size_t>(k)],
                            frames[static_cast<std::size_t>(k) + 1]);
  return out;
}

int low_pass_reach(double frequency, double h) {
  return static_cast<int>(kCutOff * (kHalfPower / frequency / h)) + 1;
}

std::vector<VectorX> low_pass(const Model& model, const std::vector<VectorX>& frames, double h,
                              double frequency) {
  const double deviation = kHalfPower / frequency / h;
  const int reach = low_pass_reach(frequency, h);
  const int last = static_cast<int>(frames.size()) - 1;
  std::vector<VectorX> out;
  for (int t = 0; t <= last; ++t) {
    const VectorX& own = frames[static_cast<std::size_t>(t)];
    VectorX sum = VectorX::Zero(model.nv());
    double weights = 0.0;
    for (int k = -reach; k <= reach; ++k) {
      const double weight = std::exp(-0.5 * std::pow(k / deviation, 2));
      const int end = t + k < 0 ? 0 : last, at = t + k;
      weights += weight;
      if (at >= 0 && at <= last) {
        sum += weight * difference(model, own, frames[static_cast<std::size_t>(at)]);
        continue;
      }
      const int mirrored = std::clamp(2 * end - at, 0, last);
      sum += weight * (2.0 * difference(model, own, frames[static_cast<std::size_t>(end)]) -
                       difference(model, own, frames[static_cast<std::size_t>(mirrored)]));
    }
    out.push_back(moved(model, own, sum / weights));
  }
  return out;
}

VectorX white_noise(const Model& model, const std::vector<VectorX>& frames, int order) {
  VectorX out = VectorX::Zero(model.nv());
  const MatrixX d = steps_of(model, frames);
  for (int i = 0; i < model.nv(); ++i) out[i] = series_noise(d.row(i).transpose(), order);
  return out;
}

MatrixX accelerations(const Model& model, const std::vector<VectorX>& frames, double h) {
  const auto count = static_cast<Eigen::Index>(frames.size());
  MatrixX out = MatrixX::Zero(model.nv(), count);
  const MatrixX d = steps_of(model, frames);
  for (Eigen::Index t = 1; t + 1 < count; ++t) out.col(t) = (d.col(t) - d.col(t - 1)) / (h * h);
  return out;
}

}  // namespace counterpoint::estimation
