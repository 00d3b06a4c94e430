// The least squares problem solved by Levenberg-Marquardt: parameters scaled to [0, 1], with a loss
// per group of residuals.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <unsupported/Eigen/LevenbergMarquardt>
#include <utility>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation::fitting {

/// Residuals depend on a parameter if the norm of their derivative exceeds this fraction of the
/// largest one. Round-off of wide differences gives up to 1.4e-7 (mass of a thrown cube).
inline constexpr double kDependence = 1e-6;

/// Parameters as fractions ("shares") of their ranges: 0 at the lower bound, 1 at the upper one.
class Shares {
 public:
  explicit Shares(const FitProblem& problem) : problem_(problem) {}

  VectorX values(const VectorX& shares) const {
    VectorX out(shares.size());
    for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = value(i, shares[i]);
    return out;
  }
  double value(Eigen::Index i, double share) const {
    const double s = std::clamp(share, 0.0, 1.0);
    const double low = problem_.lower[i], high = problem_.upper[i];
    if (s == 0.0) return low;
    if (s == 1.0) return high;
    return problem_.logarithmic[i] ? low * std::pow(high / low, s) : low + s * (high - low);
  }
  /// Ranges between the bounds, of logarithms for logarithmic parameters.
  VectorX ranges() const {
    VectorX out = problem_.upper - problem_.lower;
    for (Eigen::Index i = 0; i < out.size(); ++i)
      if (problem_.logarithmic[static_cast<size_t>(i)])
        out[i] = std::log(problem_.upper[i] / problem_.lower[i]);
    return out;
  }
  /// d value / d share.
  double slope(Eigen::Index i, double share) const {
    const double low = problem_.lower[i], high = problem_.upper[i];
    return problem_.logarithmic[i] ? value(i, share) * std::log(high / low) : high - low;
  }
  double share(Eigen::Index i, double value) const {
    const double low = problem_.lower[i], high = problem_.upper[i];
    const double s = problem_.logarithmic[i]
                         ? std::log(std::max(value, low) / low) / std::log(high / low)
                         : (value - low) / (high - low);
    return std::clamp(s, 0.0, 1.0);
  }

 private:
  const FitProblem& problem_;
};

/// Scales the residuals of a group so that their squared norm is the loss.
class Loss {
 public:
  /// scale2: squared scale of the Cauchy loss; 0: squares.
  explicit Loss(double scale2 = 0.0) : scale2_(scale2) {}
  double scale2() const { return scale2_; }
  double of(double square) const {
    return scale2_ > 0.0 ? scale2_ * std::log1p(square / scale2_) : square;
  }
  double factor(double square) const {
    return square > 0.0 && scale2_ > 0.0 ? std::sqrt(of(square) / square) : 1.0;
  }
  /// Derivative of the factor with respect to the square.
  double factor_slope(double square) const {
    if (!(square > 0.0 && scale2_ > 0.0)) return 0.0;
    const double f = factor(square), slope = 1.0 / (1.0 + square / scale2_);
    return (slope - f * f) / (2.0 * square * f);
  }

 private:
  double scale2_;
};

/// Thrown if FitOptions::stop returns true.
struct StopWanted {};

/// Number of evaluations of a fit.
struct Counts {
  int evaluations = 0, linearizations = 0;
  bool stopped = false;
  Counts& operator+=(const Counts& o) {
    evaluations += o.evaluations;
    linearizations += o.linearizations;
    stopped = stopped || o.stopped;
    return *this;
  }
};

/// Progress of a fit in evaluations, shared by all threads.
class Work {
 public:
  Work(const FitOptions& options, int planned) : options_(options), planned_(planned) {}
  int planned() const { return planned_; }
  int done() const { return done_; }
  void tell(int evaluations) {
    const std::lock_guard lock(mutex_);
    done_ = std::min(done_ + evaluations, planned_);
    if (options_.progress) options_.progress(done_, planned_);
  }

 private:
  const FitOptions& options_;
  int planned_;
  std::atomic<int> done_{0};
  std::mutex mutex_;
};

/// Sum of squares.
inline double total(const GroupedResiduals& r) {
  double sum = 0.0;
  for (const VectorX& g : r) sum += g.squaredNorm();
  return sum;
}

/// Weighted residuals of all groups as functions of the shares, with extra rows that penalize
/// shares outside [0, 1]. Not thread-safe: each thread uses its own copy.
struct System : Eigen::DenseFunctor<double> {
  const FitProblem& problem;
  const Shares& shares;
  Loss loss;
  std::vector<double> weights;  // weights of the groups' losses
  double difference, bound_weight;
  bool exact;
  std::function<bool()> stop;
  bool may_stop = false;  // true within unless_stopped
  mutable Counts counts;
  /// The best point evaluated since `seen` was reset, with its cost: the result of stopped work.
  mutable std::optional<std::pair<double, VectorX>> seen;

  System(const FitProblem& p, const Shares& s, const FitOptions& options, int groups, int size)
      : DenseFunctor(static_cast<int>(p.start.size()), size + static_cast<int>(p.start.size())),
        problem(p),
        shares(s),
        weights(groups, 1.0),
        difference(options.difference),
        bound_weight(1.0),
        exact(false),
        stop(options.stop) {}

  /// Calls act(), which StopWanted may end. Returns false if stopped now or earlier.
  template <class Act>
  bool unless_stopped(Act act) {
    if (counts.stopped) return false;
    may_stop = true;
    try {
      act();
    } catch (const StopWanted&) {
      counts.stopped = true;
    }
    may_stop = false;
    return !counts.stopped;
  }

  /// Enables exact derivatives; last: this is the last stage of a refinement.
  void use_exact(const FitOptions& options, bool last) {
    exact = options.exact && problem.linearize && (last || !problem.rough);
  }

  void check_stop() const {
    if (may_stop && stop && stop()) throw StopWanted();
  }

  /// Applies the loss.
  GroupedResiduals weighted(GroupedResiduals r) const {
    for (size_t g = 0; g < r.size(); ++g)
      r[g] *= loss.factor(r[g].squaredNorm()) * std::sqrt(weights[g]);
    return r;
  }

  GroupedResiduals groups(const VectorX& at) const {
    check_stop();
    ++counts.evaluations;
    GroupedResiduals r = weighted(problem.residuals(shares.values(at)));
    check_stop();  // residuals that were stopped halfway are invalid
    if (const double cost = total(r); !seen || cost < seen->first) seen.emplace(cost, at);
    return r;
  }

  int operator()(const VectorX& at, VectorX& out) const {
    const VectorX inside = at.cwiseMax(0.0).cwiseMin(1.0);
    Eigen::Index row = 0;
    for (const VectorX& r : groups(inside)) {
      out.segment(row, r.size()) = r;
      row += r.size();
    }
    out.tail(at.size()) = bound_weight * (at - inside);
    return 0;
  }

  /// Derivatives of the groups' residuals with respect to one parameter, one-sided at the bounds.
  GroupedResiduals derivative(const VectorX& at, Eigen::Index i) const {
    VectorX high = at, low = at;
    high[i] = std::min(at[i] + difference, 1.0);
    low[i] = std::max(at[i] - difference, 0.0);
    GroupedResiduals d = groups(high);
    const GroupedResiduals below = groups(low);
    for (size_t g = 0; g < d.size(); ++g) d[g] = (d[g] - below[g]) / (high[i] - low[i]);
    return d;
  }

  /// Jacobians of all groups: exact columns where the problem has them.
  std::vector<MatrixX> derivatives(const VectorX& at) const {
    std::optional<LinearizedResiduals> known;
    if (exact) {
      ++counts.linearizations;
      known = problem.linearize(shares.values(at));
      check_stop();
    }
    std::vector<MatrixX> out;
    if (known) {
      for (size_t g = 0; g < known->residuals.size(); ++g)
        out.push_back(chained(known->residuals[g], known->jacobians[g], at, weights[g]));
    }
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      if (known && problem.exact[static_cast<size_t>(i)]) continue;
      const GroupedResiduals d = derivative(at, i);
      for (size_t g = 0; g < d.size(); ++g) {
        if (out.size() == g) out.emplace_back(MatrixX::Zero(d[g].size(), at.size()));
        out[g].col(i) = d[g];
      }
    }
    return out;
  }

  /// Jacobian of the weighted residuals with respect to the shares, by the chain rule.
  MatrixX chained(const VectorX& r, const MatrixX& by_values, const VectorX& at,
                  double weight) const {
    MatrixX J = by_values;
    for (Eigen::Index i = 0; i < at.size(); ++i) J.col(i) *= shares.slope(i, at[i]);
    const double square = r.squaredNorm();
    const Eigen::RowVectorXd along = (2.0 * loss.factor_slope(square)) * (r.transpose() * J);
    return std::sqrt(weight) * (loss.factor(square) * J + r * along);
  }

  int df(const VectorX& at, MatrixX& jacobian) const {
    const VectorX inside = at.cwiseMax(0.0).cwiseMin(1.0);
    jacobian.setZero();
    Eigen::Index row = 0;
    for (const MatrixX& J : derivatives(inside)) {
      for (Eigen::Index i = 0; i < at.size(); ++i)
        if (at[i] == inside[i]) jacobian.col(i).segment(row, J.rows()) = J.col(i);
      row += J.rows();
    }
    // Round-off in independent residuals must not drive a parameter to the ends of its range.
    const double least = kDependence * jacobian.colwise().norm().maxCoeff();
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      if (jacobian.col(i).norm() < least) jacobian.col(i).setZero();
      if (at[i] != inside[i]) jacobian(values() - inputs() + i, i) = bound_weight;
    }
    return 0;
  }
};

}  // namespace counterpoint::estimation::fitting
