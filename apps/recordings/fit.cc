#include "fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <unsupported/Eigen/LevenbergMarquardt>

namespace counterpoint::apps {
namespace {

/// Residuals depend on a parameter if their derivative is more than this share of the largest.
constexpr double kDependence = 1e-7;

/// Stages of a refinement: so many times coarser are their differences.
constexpr std::array<double, 3> kCoarser = {30.0, 5.0, 1.0};

/// Parameters as shares of their ranges, 0 at the lower bound and 1 at the upper one.
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

/// The residuals of one group as the loss has them: their square sum is the loss.
class Loss {
 public:
  /// scale2: of Cauchy's loss; 0: squares.
  explicit Loss(double scale2 = 0.0) : scale2_(scale2) {}
  double scale2() const { return scale2_; }
  double of(double square) const {
    return scale2_ > 0.0 ? scale2_ * std::log1p(square / scale2_) : square;
  }
  double factor(double square) const {
    return square > 0.0 && scale2_ > 0.0 ? std::sqrt(of(square) / square) : 1.0;
  }
  /// Of the factor by the square.
  double factor_slope(double square) const {
    if (!(square > 0.0 && scale2_ > 0.0)) return 0.0;
    const double f = factor(square), slope = 1.0 / (1.0 + square / scale2_);
    return (slope - f * f) / (2.0 * square * f);
  }

 private:
  double scale2_;
};

/// FitOptions::stop says so.
struct StopWanted {};

/// Weighted residuals of all groups over shares, with rows that hold the shares within 0 ... 1.
struct System : Eigen::DenseFunctor<double> {
  const FitProblem& problem;
  const Shares& shares;
  Loss loss;
  std::vector<double> weights;  // of the groups' losses
  double difference, bound_weight;
  bool exact;
  std::function<bool()> stop;
  bool may_stop = false;      // in unless_stopped
  int work = 0, planned = 0;  // in evaluations, at most; nothing is told where none is planned
  Fit& counts;

  System(const FitProblem& p, const Shares& s, const FitOptions& options, int groups, int size,
         Fit& out)
      : DenseFunctor(static_cast<int>(p.start.size()), size + static_cast<int>(p.start.size())),
        problem(p),
        shares(s),
        weights(groups, 1.0),
        difference(options.difference),
        bound_weight(1.0),
        exact(false),
        stop(options.stop),
        counts(out) {}

  /// Calls act(), and ends it where it is asked to stop. False if so, or if that was before.
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

  /// last: of the stages of a refinement.
  void use_exact(const FitOptions& options, bool last) {
    exact = options.exact && problem.linearize && (last || !problem.rough);
  }

  /// So many more evaluations of those planned are done.
  void tell(const FitOptions& options, int evaluations) {
    work = std::min(work + evaluations, planned);
    if (options.progress && planned > 0) options.progress(work, planned);
  }

  GroupedResiduals groups(const VectorX& at) const {
    if (may_stop && stop && stop()) throw StopWanted();
    ++counts.evaluations;
    GroupedResiduals r = problem.residuals(shares.values(at));
    for (size_t g = 0; g < r.size(); ++g)
      r[g] *= loss.factor(r[g].squaredNorm()) * std::sqrt(weights[g]);
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

  /// Derivatives of the groups' residuals by one parameter, one-sided at the bounds.
  GroupedResiduals derivative(const VectorX& at, Eigen::Index i) const {
    VectorX high = at, low = at;
    high[i] = std::min(at[i] + difference, 1.0);
    low[i] = std::max(at[i] - difference, 0.0);
    GroupedResiduals d = groups(high);
    const GroupedResiduals below = groups(low);
    for (size_t g = 0; g < d.size(); ++g) d[g] = (d[g] - below[g]) / (high[i] - low[i]);
    return d;
  }

  /// Those of all groups by all parameters: exact where the problem knows them.
  std::vector<MatrixX> derivatives(const VectorX& at) const {
    std::optional<LinearizedResiduals> known;
    if (exact) {
      ++counts.linearizations;
      known = problem.linearize(shares.values(at));
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

  /// By shares, of the residuals as `groups` has them.
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
    // Rounding of what does not depend on a parameter must not send it off to the ends of the
    // range.
    const double least = kDependence * jacobian.colwise().norm().maxCoeff();
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      if (jacobian.col(i).norm() < least) jacobian.col(i).setZero();
      if (at[i] != inside[i]) jacobian(values() - inputs() + i, i) = bound_weight;
    }
    return 0;
  }
};

double total(const GroupedResiduals& r) {
  double sum = 0.0;
  for (const VectorX& g : r) sum += g.squaredNorm();
  return sum;
}

/// Point k of Halton's sequence: evenly spread in any number of dimensions, the same every time.
VectorX halton(int k, Eigen::Index dimensions) {
  constexpr std::array<int, 16> kBases = {2,  3,  5,  7,  11, 13, 17, 19,
                                          23, 29, 31, 37, 41, 43, 47, 53};
  VectorX point(dimensions);
  for (Eigen::Index i = 0; i < dimensions; ++i) {
    const int base = kBases[static_cast<size_t>(i) % kBases.size()];
    double share = 1.0;
    point[i] = 0.0;
    for (int n = k; n > 0; n /= base) {
      share /= base;
      point[i] += share * (n % base);
    }
  }
  return point;
}

bool is_under_way(Eigen::LevenbergMarquardtSpace::Status status) {
  return status == Eigen::LevenbergMarquardtSpace::NotStarted ||
         status == Eigen::LevenbergMarquardtSpace::Running;
}

/// By differences on both sides.
int evaluations_of_derivatives(const VectorX& at) { return 2 * static_cast<int>(at.size()); }

/// Levenberg-Marquardt with differences over ever smaller steps: predictions with contacts are
/// rough functions of their parameters, and small steps would follow the roughness.
VectorX refine(System& system, const VectorX& from, const FitOptions& options, int rounds) {
  VectorX best = from;
  double cost = total(system.groups(best));
  for (const double coarser : kCoarser) {
    system.difference = coarser * options.difference;
    system.use_exact(options, coarser == 1.0);
    VectorX at = best;
    Eigen::LevenbergMarquardt<System> solver(system);
    solver.setFactor(0.3);  // first steps of a third of the ranges at most
    solver.setFtol(coarser > 1.0 ? 1e-3 : 1e-9);
    solver.setXtol(coarser > 1.0 ? 1e-2 : 1e-7);
    solver.setMaxfev(rounds);
    const bool ended = system.unless_stopped([&] {
      using Eigen::LevenbergMarquardtSpace::Status;
      for (Status status = solver.minimizeInit(at); is_under_way(status);) {
        status = solver.minimizeOneStep(at);
        system.tell(options, 1 + evaluations_of_derivatives(at));
      }
    });
    at = at.cwiseMax(0.0).cwiseMin(1.0);
    const double found = total(system.groups(at));
    if (found < cost) {
      cost = found;
      best = at;
    }
    if (!ended) break;
  }
  return best;
}

/// The median of |t| with so many degrees of freedom that 95 % do not exceed: Cornish and Fisher's
/// expansion about the normal quantile, within 1 % from 4 degrees on.
double student_95(double degrees) {
  constexpr double z = 1.959963984540054;
  const double n = std::max(degrees, 1.0), z2 = z * z;
  return z + z * (z2 + 1.0) / (4.0 * n) + z * (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * n * n) +
         z * (3.0 * z2 * z2 * z2 + 19.0 * z2 * z2 + 17.0 * z2 - 15.0) / (384.0 * n * n * n);
}

/// Covariance of the shares, and for which parameters it means anything.
struct Spread {
  MatrixX covariance;
  std::vector<char> known;
  double quantile = 0.0;
};

/// From derivatives at the solution. Residuals of one recording hang together, so a recording is
/// the unit: inv(H) (sum g g') inv(H) n / (n - p), g the gradient of a recording, H = J'J. Of a
/// single one: the variance of the residuals times inv(H), as if they were independent.
Spread spread(const System& system, const VectorX& at) {
  const Eigen::Index p = at.size();
  const GroupedResiduals r = system.groups(at);
  const std::vector<MatrixX> jacobians = system.derivatives(at);
  MatrixX H = MatrixX::Zero(p, p), G = MatrixX::Zero(p, p);
  Eigen::Index rows = 0;
  for (size_t g = 0; g < r.size(); ++g) {
    const VectorX gradient = jacobians[g].transpose() * r[g];
    H += jacobians[g].transpose() * jacobians[g];
    G += gradient * gradient.transpose();
    rows += r[g].size();
  }
  Spread out;
  // A parameter on which nothing depends is left out of the inverse.
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
  return out;
}

/// Refits to as many groups, drawn with replacement: percentiles of the values found.
std::vector<VectorX> bootstrap(System& system, const VectorX& at, const FitOptions& options) {
  std::mt19937_64 generator(1);
  const std::vector<double> given = system.weights;
  std::vector<VectorX> found;
  for (int k = 0; k < options.bootstrap; ++k) {
    std::fill(system.weights.begin(), system.weights.end(), 0.0);
    for (size_t draw = 0; draw < given.size(); ++draw)
      system.weights[(generator() >> 11) % given.size()] += 1.0;
    const VectorX refit = refine(system, at, options, 8);
    if (system.counts.stopped) break;
    found.push_back(refit);
    if (options.progress) options.progress(k + 1, options.bootstrap);
  }
  system.weights = given;
  return found;
}

void check(const FitProblem& problem, int residuals) {
  if (!problem.start.allFinite() || !problem.lower.allFinite() || !problem.upper.allFinite() ||
      !(problem.lower.array() < problem.upper.array()).all())
    throw InputError("fit: start and bounds must be finite, and each lower bound below the upper");
  if (residuals < problem.start.size())
    throw InputError(fmt::format("fit: {} residuals cannot give {} parameters", residuals,
                                 problem.start.size()));
}

/// The start and the samples, best first.
std::vector<std::pair<double, VectorX>> explore(System& system, const VectorX& start,
                                                const FitOptions& options) {
  std::vector<std::pair<double, VectorX>> tried;
  system.unless_stopped([&] {
    tried.emplace_back(total(system.groups(start)), start);
    for (int k = 1; k <= options.samples; ++k) {
      const VectorX at = halton(k, start.size());
      tried.emplace_back(total(system.groups(at)), at);
      system.tell(options, 1);
    }
  });
  if (tried.empty()) tried.emplace_back(0.0, start);  // stopped
  std::stable_sort(tried.begin(), tried.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  return tried;
}

/// Of a whole refinement, at most.
int refinement_evaluations(const FitOptions& options, const VectorX& at) {
  return static_cast<int>(kCoarser.size()) * options.max_rounds *
         (1 + evaluations_of_derivatives(at));
}

/// Refines points as long as nothing stops it, one at least looked at; sorts them, best first.
void refine_all(System& system, const FitOptions& options,
                std::vector<std::pair<double, VectorX>>& points) {
  size_t done = 0;
  for (; done < points.size() && (done == 0 || !system.counts.stopped); ++done) {
    auto& [cost, at] = points[done];
    cost = total(system.groups(at));
    system.bound_weight = 10.0 * std::sqrt(std::max(cost, 1e-300));
    const int before = system.work;
    const VectorX better = refine(system, at, options, options.max_rounds);
    system.tell(options, before + refinement_evaluations(options, at) - system.work);
    const double found = total(system.groups(better));
    if (found < cost) {
      cost = found;
      at = better;
    }
  }
  points.resize(done);
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
}

double median_square(const GroupedResiduals& r) {
  std::vector<double> squares;
  for (const VectorX& g : r) squares.push_back(g.squaredNorm());
  std::nth_element(squares.begin(),
                   squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2),
                   squares.end());
  return squares[squares.size() / 2];
}

/// The median over groups at a point says how far off is far.
void set_loss(System& system, const VectorX& at, const FitOptions& options) {
  system.loss = Loss();
  const GroupedResiduals r = system.groups(at);
  if (options.robust && r.size() > 2) system.loss = Loss(median_square(r));
}

void fill(const Shares& shares, const VectorX& at, const Spread& s,
          const std::vector<VectorX>& refits, Fit& out) {
  const Eigen::Index p = at.size();
  out.correlation = MatrixX::Zero(p, p);
  for (Eigen::Index i = 0; i < p; ++i) {
    FittedParameter& parameter = out.parameters.emplace_back();
    parameter.value = shares.value(i, at[i]);
    parameter.at_bound = at[i] <= 0.0 || at[i] >= 1.0;
    if (s.known[i]) {
      const double half = s.quantile * std::sqrt(std::max(s.covariance(i, i), 0.0));
      parameter.interval = {shares.value(i, at[i] - half), shares.value(i, at[i] + half)};
    }
    for (Eigen::Index j = 0; j < p; ++j) {
      const double scale = std::sqrt(s.covariance(i, i) * s.covariance(j, j));
      if (scale > 0.0) out.correlation(i, j) = s.covariance(i, j) / scale;
    }
    if (refits.empty()) continue;
    std::vector<double> found;
    for (const VectorX& refit : refits) found.push_back(refit[i]);
    std::sort(found.begin(), found.end());
    const double last = static_cast<double>(found.size() - 1);
    parameter.bootstrap = {shares.value(i, found[static_cast<size_t>(std::lround(0.025 * last))]),
                           shares.value(i, found[static_cast<size_t>(std::lround(0.975 * last))])};
  }
}

}  // namespace

VectorX Fit::values() const {
  VectorX out(static_cast<Eigen::Index>(parameters.size()));
  for (size_t i = 0; i < parameters.size(); ++i)
    out[static_cast<Eigen::Index>(i)] = parameters[i].value;
  return out;
}

Fit fit(const FitProblem& problem, const FitOptions& options) {
  const Shares shares(problem);
  const GroupedResiduals first = problem.residuals(problem.start);
  int size = 0;
  for (const VectorX& g : first) size += static_cast<int>(g.size());
  check(problem, size);
  Fit out;
  System system(problem, shares, options, static_cast<int>(first.size()), size, out);
  VectorX start(problem.start.size());
  for (Eigen::Index i = 0; i < start.size(); ++i) start[i] = shares.share(i, problem.start[i]);

  const int refined = std::clamp(options.refined, 1, options.samples + 1);
  system.planned = options.samples + refined * refinement_evaluations(options, start);
  system.unless_stopped([&] { set_loss(system, start, options); });
  std::vector<std::pair<double, VectorX>> tried = explore(system, start, options);
  set_loss(system, tried[0].second, options);
  out.loss_scale = std::sqrt(system.loss.scale2());
  out.start_cost = total(system.groups(start));
  tried.resize(std::min(tried.size(), static_cast<size_t>(refined)));
  refine_all(system, options, tried);
  for (const auto& [cost, at] : tried) out.refined_costs.push_back(cost);
  VectorX& best = tried[0].second;
  out.cost = tried[0].first;
  // Differences over what intervals span, not over the roughness: too large an H is too narrow an
  // interval.
  system.difference = 10.0 * options.difference;
  system.use_exact(options, false);
  Spread s;
  if (system.unless_stopped([&] { s = spread(system, best); })) {
    // What nothing depends on stays as it is in the scene.
    for (Eigen::Index i = 0; i < best.size(); ++i)
      if (!s.known[i]) best[i] = start[i];
  } else {
    s.known.assign(static_cast<size_t>(best.size()), 0);
    s.covariance = MatrixX::Zero(best.size(), best.size());
  }
  system.planned = 0;  // refits tell by themselves
  const bool more = !out.stopped && options.bootstrap > 0;
  fill(shares, best, s, more ? bootstrap(system, best, options) : std::vector<VectorX>(), out);
  return out;
}

}  // namespace counterpoint::apps
