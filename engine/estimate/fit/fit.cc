#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <tuple>

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "counterpoint/engine/estimate/fit/fit_system.h"
#include "counterpoint/engine/tasks.h"

namespace counterpoint::estimation {
namespace {

using fitting::Counts;
using fitting::Loss;
using fitting::Shares;
using fitting::Spread;
using fitting::spread;
using fitting::System;
using fitting::total;
using fitting::Work;

/// Factors of the difference steps in the stages of a refinement.
constexpr std::array<double, 3> kCoarser = {30.0, 5.0, 1.0};

/// Point k of the Halton sequence: a deterministic low-discrepancy sequence.
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

using Tried = std::pair<double, VectorX>;

bool is_under_way(Eigen::LevenbergMarquardtSpace::Status status) {
  return status == Eigen::LevenbergMarquardtSpace::NotStarted ||
         status == Eigen::LevenbergMarquardtSpace::Running;
}

/// Number of evaluations of a Jacobian by central differences.
int evaluations_of_derivatives(const VectorX& at) { return 2 * static_cast<int>(at.size()); }

/// Levenberg-Marquardt with differences over decreasing steps: predictions with contacts are rough
/// functions of their parameters, and small steps would follow the roughness. If stopped, returns
/// the best point so far, which may be `from` with infinite cost.
Tried refine(System& system, const VectorX& from, const FitOptions& options, int rounds,
             const std::function<void(int evaluations)>& tell = {}) {
  VectorX best = from;
  double cost = std::numeric_limits<double>::infinity();
  if (!system.unless_stopped([&] { cost = total(system.groups(best)); })) return {cost, best};
  for (const double coarser : kCoarser) {
    system.difference = coarser * options.difference;
    system.use_exact(options, coarser == 1.0);
    system.seen.reset();
    VectorX at = best;
    double found = 0.0;
    Eigen::LevenbergMarquardt<System> solver(system);
    solver.setFactor(0.3);  // limits the first step to about 0.3 of the ranges
    solver.setFtol(coarser > 1.0 ? 1e-3 : 1e-9);
    solver.setXtol(coarser > 1.0 ? 1e-2 : 1e-7);
    solver.setMaxfev(rounds);
    const bool ended = system.unless_stopped([&] {
      using Eigen::LevenbergMarquardtSpace::Status;
      for (Status status = solver.minimizeInit(at); is_under_way(status);) {
        status = solver.minimizeOneStep(at);
        if (tell) tell(1 + evaluations_of_derivatives(at));
      }
      at = at.cwiseMax(0.0).cwiseMin(1.0);
      found = total(system.groups(at));
    });
    if (!ended && system.seen) std::tie(found, at) = *system.seen;
    if ((ended || system.seen) && found < cost) {
      cost = found;
      best = at;
    }
    if (!ended) break;
  }
  return {cost, best};
}

void check(const FitProblem& problem, int residuals) {
  if (!problem.start.allFinite() || !problem.lower.allFinite() || !problem.upper.allFinite() ||
      !(problem.lower.array() < problem.upper.array()).all())
    throw InputError("fit: start and bounds must be finite, and each lower bound below the upper");
  if (residuals < problem.start.size())
    throw InputError(fmt::format("fit: {} residuals cannot give {} parameters", residuals,
                                 problem.start.size()));
}

/// Upper bound of the evaluations of one refinement.
int refinement_evaluations(const FitOptions& options, const VectorX& at) {
  return static_cast<int>(kCoarser.size()) * options.max_rounds *
         (1 + evaluations_of_derivatives(at));
}

/// Weight of the rows that penalize shares outside [0, 1]: an excess of 0.1 costs as much as the
/// residuals.
double bound_weight(double cost) { return 10.0 * std::sqrt(std::max(cost, 1e-300)); }

void sort_by_cost(std::vector<Tried>& points) {
  std::stable_sort(points.begin(), points.end(),
                   [](const Tried& a, const Tried& b) { return a.first < b.first; });
}

/// Result of a task as bytes: the counts, then its numbers; nothing if it has no numbers.
std::string bytes_of(const Counts& counts, const VectorX& numbers) {
  if (numbers.size() == 0) return {};
  std::string bytes(sizeof counts, '\0');
  std::memcpy(bytes.data(), &counts, sizeof counts);
  return bytes.append(reinterpret_cast<const char*>(numbers.data()),
                      static_cast<size_t>(numbers.size()) * sizeof(double));
}

std::pair<Counts, VectorX> result_of(const std::string& bytes) {
  Counts counts;
  if (bytes.size() <= sizeof counts) throw InputError("the result of a task is cut short");
  std::memcpy(&counts, bytes.data(), sizeof counts);
  VectorX numbers(static_cast<Eigen::Index>((bytes.size() - sizeof counts) / sizeof(double)));
  std::memcpy(numbers.data(), bytes.data() + sizeof counts,
              static_cast<size_t>(numbers.size()) * sizeof(double));
  return {counts, numbers};
}

/// The task lists of a fit; each task works on a copy of the system.
class FitTasks {
 public:
  FitTasks(System& system, const FitOptions& options, const VectorX& start, int refined)
      : system_(system),
        options_(options),
        work_(options, options.samples + refined * refinement_evaluations(options, start)) {}

  /// A task was stopped: the remaining lists are skipped, on every process.
  bool stopped() const { return stopped_; }

  /// Evaluates the start and the samples; returns them best first, or the start if none was
  /// evaluated.
  std::vector<Tried> explore(const VectorX& start, double start_cost) {
    const auto point = [&](int k) { return k == 0 ? start : halton(k, start.size()); };
    std::vector<Tried> tried;
    run(
        kSamples, options_.samples + 1,
        [&](System& mine, int k) {
          VectorX cost(1);
          if (!mine.unless_stopped([&] { cost[0] = total(mine.groups(point(k))); }))
            return VectorX();
          if (k > 0) work_.tell(1);
          return cost;
        },
        [&](int k, const VectorX& cost) { tried.emplace_back(cost[0], point(k)); });
    if (tried.empty()) tried.emplace_back(start_cost, start);
    sort_by_cost(tried);
    return tried;
  }

  /// Refines the points and sorts them, best first. Drops unrefined points; if none was refined,
  /// keeps the first.
  void refine_all(std::vector<Tried>& points) {
    const int each = refinement_evaluations(options_, points[0].second);
    const int before = work_.done();
    std::vector<Tried> refined;
    run(
        kRefinements, static_cast<int>(points.size()),
        [&](System& mine, int k) {
          return refine_point(mine, points[static_cast<size_t>(k)].second, each);
        },
        [&](int, const VectorX& found) {
          refined.emplace_back(found[0], found.tail(found.size() - 1));
        },
        [&] { return static_cast<double>(work_.done() - before) / each; });
    if (refined.empty()) refined.push_back(points[0]);
    points = std::move(refined);
    sort_by_cost(points);
  }

  /// Bootstrap: refits to groups drawn with replacement, as many as there are.
  std::vector<VectorX> refit(const VectorX& at) {
    Work work(options_, options_.bootstrap);
    std::vector<VectorX> found;
    run(
        kRefits, options_.bootstrap,
        [&](System& mine, int k) {
          draw_weights(k, mine.weights);
          const VectorX refitted = refine(mine, at, options_, 8).second;
          if (mine.counts.stopped) return VectorX();
          work.tell(1);
          return refitted;
        },
        [&](int, const VectorX& refitted) { found.push_back(refitted); });
    return found;
  }

  static constexpr const char *kSamples = "samples", *kRefinements = "refinements",
                              *kRefits = "refits";

 private:
  /// Runs a list of tasks. `act` returns the result of a task number, empty if it was stopped
  /// before it had one; `take` gets the results in order of number.
  template <class Act, class Take>
  void run(const char* name, int count, Act act, Take take, std::function<double()> work = {}) {
    tasks::TaskList list;
    list.name = name;
    list.count = count;
    list.fingerprint = options_.fingerprint;
    list.work = std::move(work);
    list.make_task = [this, act]() -> tasks::Task {
      return [this, act](std::int64_t number) {
        System mine = system_;
        mine.counts = {};
        const VectorX result = act(mine, static_cast<int>(number));
        return tasks::Outcome{bytes_of(mine.counts, result), !mine.counts.stopped};
      };
    };
    int number = 0;
    for (const auto& bytes : options_.run(list)) {
      if (bytes) {
        const auto [counts, result] = result_of(*bytes);
        stopped_ = stopped_ || counts.stopped;
        system_.counts += counts;
        take(number, result);
      } else {
        stopped_ = system_.counts.stopped = true;
      }
      ++number;
    }
  }

  /// Cost and place of the best point. `each`: number of evaluations that the task reports in
  /// total.
  VectorX refine_point(System& mine, const VectorX& at, int each) {
    double cost = 0.0;
    if (!mine.unless_stopped([&] { cost = total(mine.groups(at)); })) return {};
    mine.bound_weight = bound_weight(cost);
    int told = 0;
    const auto tell = [&](int evaluations) {
      const int more = std::min(evaluations, each - told);
      told += more;
      work_.tell(more);
    };
    const auto [found, better] = refine(mine, at, options_, options_.max_rounds, tell);
    tell(each);
    VectorX best(at.size() + 1);
    best << std::min(found, cost), (found < cost ? better : at);
    return best;
  }

  /// Bootstrap weights: as many draws as groups, from a random stream that continues that of lower
  /// numbers.
  static void draw_weights(int number, std::vector<double>& weights) {
    std::mt19937_64 generator(1);
    generator.discard(static_cast<unsigned long long>(number) * weights.size());
    std::fill(weights.begin(), weights.end(), 0.0);
    for (size_t draw = 0; draw < weights.size(); ++draw)
      weights[(generator() >> 11) % weights.size()] += 1.0;
  }

  System& system_;
  const FitOptions& options_;
  Work work_;
  bool stopped_ = false;
};

double median_square(const GroupedResiduals& r) {
  std::vector<double> squares;
  for (const VectorX& g : r) squares.push_back(g.squaredNorm());
  std::nth_element(squares.begin(),
                   squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2),
                   squares.end());
  return squares[squares.size() / 2];
}

/// Sets the loss scale to the median of the groups' plain residual norms.
void set_loss(System& system, const GroupedResiduals& r, const FitOptions& options) {
  system.loss = Loss();
  if (options.robust && r.size() > 2) system.loss = Loss(median_square(r));
}

/// Resets the loss at the best sampled point and updates its cost, unless stopped.
void set_loss_at_best(System& system, const FitOptions& options, std::vector<Tried>& tried) {
  const Loss before = system.loss;
  system.loss = Loss();
  GroupedResiduals r;
  if (!system.unless_stopped([&] { r = system.groups(tried[0].second); })) {
    system.loss = before;
    return;
  }
  set_loss(system, r, options);
  tried[0].first = total(system.weighted(r));
}

void fill(const Shares& shares, const VectorX& at, const Spread& s,
          const std::vector<VectorX>& refits, Fit& out) {
  const Eigen::Index p = at.size();
  out.correlation = out.covariance = MatrixX::Zero(p, p);
  const VectorX ranges = shares.ranges();
  out.information =
      ranges.cwiseInverse().asDiagonal() * s.information * ranges.cwiseInverse().asDiagonal();
  out.information_by_recording = ranges.cwiseAbs2().cwiseInverse().asDiagonal() * s.by_recording;
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
      out.covariance(i, j) = s.covariance(i, j) * shares.slope(i, at[i]) * shares.slope(j, at[j]);
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

const char* last_fit_list(const FitOptions& options) {
  return options.bootstrap > 0 ? FitTasks::kRefits : FitTasks::kRefinements;
}

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
  System system(problem, shares, options, static_cast<int>(first.size()), size);
  VectorX start(problem.start.size());
  for (Eigen::Index i = 0; i < start.size(); ++i) start[i] = shares.share(i, problem.start[i]);

  const int refined = std::clamp(options.refined, 1, options.samples + 1);
  FitTasks lists(system, options, start, refined);
  set_loss(system, first, options);
  const bool known = !(options.stop && options.stop());  // otherwise `first` may be incomplete
  const auto start_cost = [&] { return known ? total(system.weighted(first)) : std::nan(""); };
  std::vector<Tried> tried = lists.explore(start, start_cost());
  set_loss_at_best(system, options, tried);
  out.loss_scale = std::sqrt(system.loss.scale2());
  out.start_cost = start_cost();
  tried.resize(std::min(tried.size(), static_cast<size_t>(refined)));
  if (lists.stopped() || system.counts.stopped)
    tried.resize(1);
  else if (options.max_rounds > 0)
    lists.refine_all(tried);
  for (const auto& [cost, at] : tried) out.refined_costs.push_back(cost);
  VectorX& best = tried[0].second;
  out.cost = tried[0].first;
  // Use differences as wide as the intervals: on the scale of the roughness H is too large, and
  // intervals too narrow.
  system.difference = 10.0 * options.difference;
  system.use_exact(options, false);
  Spread s;
  if (system.unless_stopped([&] { s = spread(system, best); })) {
    // Parameters without effect keep the scene's value.
    for (Eigen::Index i = 0; i < best.size(); ++i)
      if (!s.known[i]) best[i] = start[i];
  } else {
    s.known.assign(static_cast<size_t>(best.size()), 0);
    s.covariance = s.information = MatrixX::Zero(best.size(), best.size());
    s.by_recording = MatrixX::Zero(best.size(), 0);
  }
  system.bound_weight = bound_weight(out.cost);
  const bool more = !lists.stopped() && options.bootstrap > 0;
  fill(shares, best, s, more ? lists.refit(best) : std::vector<VectorX>(), out);
  out.evaluations = system.counts.evaluations;
  out.linearizations = system.counts.linearizations;
  out.stopped = system.counts.stopped;
  return out;
}

}  // namespace counterpoint::estimation
