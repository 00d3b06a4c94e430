#include "counterpoint/engine/estimate/motion/motion_filter.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {
namespace {

/// A Gaussian of this standard deviation over the frequency [Hz] has half the power there:
/// sqrt(ln 2) / (2 pi).
constexpr double kHalfPower = 0.13251;
/// It is cut off at so many standard deviations.
constexpr double kCutOff = 4.0;
/// The quantile of absolute values that a deviation is judged by, and its place in a normal
/// distribution [standard deviations]. The median would be zero where an encoder repeats itself.
constexpr double kShare = 0.75, kAtShare = 1.1503;

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

std::vector<VectorX> low_pass(const Model& model, const std::vector<VectorX>& frames, double h,
                              double frequency) {
  const double deviation = kHalfPower / frequency / h;
  const int reach = static_cast<int>(kCutOff * deviation) + 1;
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

namespace {

/// Of a series' steps; values that are NaN are missing.
double white_deviation(VectorX steps, int order) {
  double out = 0.0;
  double growth = 2.0;  // of the variance of white noise: (2 n)! / n!^2 for differences of order n
  for (int n = 2; n <= order && steps.size() > 1; ++n) {
    steps = (steps.tail(steps.size() - 1) - steps.head(steps.size() - 1)).eval();
    growth *= 4.0 - 2.0 / n;
    if (n < 3) continue;
    std::vector<double> size;
    for (const double d : steps)
      if (std::isfinite(d)) size.push_back(std::abs(d));
    if (size.empty()) break;
    const auto at = size.begin() + static_cast<std::ptrdiff_t>(kShare * (size.size() - 1));
    std::nth_element(size.begin(), at, size.end());
    const double noise = *at / kAtShare / std::sqrt(growth);
    out = n == 3 ? noise : std::min(out, noise);
  }
  return out;
}

}  // namespace

double white_noise(const VectorX& series) {
  const Eigen::Index n = series.size();
  return n < 4 ? 0.0 : white_deviation(series.tail(n - 1) - series.head(n - 1), 3);
}

VectorX white_noise(const Model& model, const std::vector<VectorX>& frames, int order) {
  VectorX out = VectorX::Zero(model.nv());
  const MatrixX d = steps_of(model, frames);
  for (int i = 0; i < model.nv(); ++i) out[i] = white_deviation(d.row(i).transpose(), order);
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
