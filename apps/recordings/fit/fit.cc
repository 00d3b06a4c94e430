#include "fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "fit_spread.h"
#include "fit_system.h"

namespace counterpoint::apps {
namespace {

using fitting::Loss;
using fitting::Shares;
using fitting::Spread;
using fitting::spread;
using fitting::System;
using fitting::total;

/// Stages of a refinement: so many times coarser are their differences.
constexpr std::array<double, 3> kCoarser = {30.0, 5.0, 1.0};

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
