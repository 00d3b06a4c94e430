#include "counterpoint/engine/estimate/fit/fit_spread.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/identifiability.h"

namespace counterpoint::estimation::fitting {
namespace {

/// Least variance of residuals: exact data have none.
constexpr double kLeastVariance = 1e-30;

}  // namespace

// Cornish-Fisher expansion about the normal quantile; within 1 % from 4 degrees of freedom on.
double student_95(double degrees) {
  constexpr double z = 1.959963984540054;
  const double n = std::max(degrees, 1.0), z2 = z * z;
  return z + z * (z2 + 1.0) / (4.0 * n) + z * (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * n * n) +
         z * (3.0 * z2 * z2 * z2 + 19.0 * z2 * z2 + 17.0 * z2 - 15.0) / (384.0 * n * n * n);
}

Spread spread(const System& system, const VectorX& at) {
  const Eigen::Index p = at.size();
  const GroupedResiduals r = system.groups(at);
  const std::vector<MatrixX> jacobians = system.derivatives(at);
  MatrixX H = MatrixX::Zero(p, p), G = MatrixX::Zero(p, p);
  Spread out;
  out.by_recording.resize(p, static_cast<Eigen::Index>(r.size()));
  Eigen::Index rows = 0;
  for (size_t g = 0; g < r.size(); ++g) {
    const VectorX gradient = jacobians[g].transpose() * r[g];
    H += jacobians[g].transpose() * jacobians[g];
    G += gradient * gradient.transpose();
    out.by_recording.col(static_cast<Eigen::Index>(g)) =
        jacobians[g].colwise().squaredNorm().transpose();
    rows += r[g].size();
  }
  out.information = H;
  // Parameters without effect are left out of the inverse.
  const double largest = H.diagonal().maxCoeff();
  out.known.resize(p);
  for (Eigen::Index i = 0; i < p; ++i) {
    out.known[i] = H(i, i) > kDependence * kDependence * largest && H(i, i) > 0.0;
    if (!out.known[i]) {
      H.row(i).setZero();
      H.col(i).setZero();
      G.row(i).setZero();
      G.col(i).setZero();
    }
  }
  const MatrixX inverse = H.completeOrthogonalDecomposition().pseudoInverse();
  const double n = static_cast<double>(r.size());
  if (n > static_cast<double>(p)) {
    out.covariance = inverse * G * inverse * (n / (n - static_cast<double>(p)));
    out.quantile = student_95(n - static_cast<double>(p));
  } else {
    const double degrees = std::max<double>(static_cast<double>(rows - p), 1.0);
    out.covariance = inverse * (total(r) / degrees);
    out.quantile = student_95(degrees);
  }
  // The mean ratio of variances to those of residuals of variance 1, weighted by the information.
  const double of_unit = H.diagonal().dot(inverse.diagonal());
  const double variance =
      of_unit > 0.0 ? H.diagonal().dot(out.covariance.diagonal()) / of_unit : 1.0;
  const double scale = 1.0 / std::max(variance, kLeastVariance);
  out.information *= scale;
  out.by_recording *= scale;
  return out;
}

double prior_weight(std::optional<double> deviation, double mean, bool logarithmic, double range) {
  const double wide = !deviation ? range : logarithmic ? *deviation / mean : *deviation;
  return 1.0 / (wide * wide);
}

bool is_told(double variance, double prior, double range) {
  const double known = 1.0 / variance - prior;  // the information of all but the prior
  // The range counts as a prior too, as where none is stated.
  return known > prior && (known * range * range + 1.0) * kTold * kTold > 1.0;
}

void set_parameters(const std::vector<EndPoint>& ends, const MatrixX& covariance, double quantile,
                    Fit& out) {
  const VectorX deviations = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  VectorX slopes(deviations.size());  // d value / d coordinate
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const EndPoint& end = ends[i];
    slopes[static_cast<Eigen::Index>(i)] = end.logarithmic ? end.value : 1.0;
    FittedParameter& one = out.parameters.emplace_back();
    one.value = end.value;
    const double margin = 1e-9 * (end.upper - end.lower);
    one.at_bound = end.value <= end.lower + margin || end.value >= end.upper - margin;
    if (!end.told) continue;
    const double half = quantile * deviations[static_cast<Eigen::Index>(i)];
    const auto bounded = [&](double by) {
      const double x = end.coordinate + by;
      return std::clamp(end.logarithmic ? std::exp(x) : x, end.lower, end.upper);
    };
    one.interval = {bounded(-half), bounded(half)};
  }
  out.correlation = covariance.cwiseQuotient(deviations * deviations.transpose());
  out.covariance = slopes.asDiagonal() * covariance * slopes.asDiagonal();
}

}  // namespace counterpoint::estimation::fitting
