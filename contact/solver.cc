#include "counterpoint/contact/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/island_solver.h"
#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/islands.h"
#include "counterpoint/contact/thread_pool.h"

namespace counterpoint::contact {
namespace {

Status check(const Problem& problem, const Eigen::Ref<VectorX>& w) {
  if (!w.allFinite() || !problem.is_finite()) return Status::kNotFinite;
  for (int c = 0; c < problem.num_constraints(); ++c)
    if (!is_valid(problem.law(c))) return Status::kInvalidLaw;
  return Status::kConverged;
}

// Number of softened or unfinished islands in one solve for which memory is reserved.
constexpr size_t kUsualSoftened = 16;

}  // namespace

const char* status_name(Status status) {
  constexpr const char* kNames[] = {
      "converged",       "round-off floor", "softened",   "unfinished",
      "iteration limit", "no progress",     "not finite", "singular mass matrix",
      "invalid law",     "invalid state",   "diverged"};
  return kNames[static_cast<int>(status)];
}

const char* method_name(Method method) {
  constexpr const char* kNames[] = {"velocity", "mixed", "softer", "stop"};
  return kNames[static_cast<int>(method)];
}

bool succeeded(Status status) {
  return status == Status::kConverged || status == Status::kRoundoffFloor ||
         status == Status::kSoftened || status == Status::kUnfinished;
}

/// Scratch memory of one thread, and the history of the first of its islands with the most steps.
struct Worker {
  using Rank = std::pair<int, int>;  ///< steps, negated, and island: the least is kept
  static constexpr Rank kNone{1, 0};

  IslandSystem system;
  IslandSolver island_solver;
  std::vector<double> w, f, history;
  Rank rank = kNone;

  Worker() { history.reserve(kUsualHistory); }
  IslandSolver::Result solve(const Problem& problem, const Settings& settings,
                             const Islands& islands, int island, Eigen::Ref<VectorX> w_all,
                             Eigen::Ref<VectorX> impulse);
};

struct Solver::Impl {
  Islands islands;
  ThreadPool* pool = nullptr;
  std::vector<std::unique_ptr<Worker>> workers;  ///< one per thread
  /// Per island: what its solve returned, and the evaluations of its line searches.
  std::vector<IslandSolver::Result> results;
  std::vector<int> evaluations;
  Report report;

  void solve_islands(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                     Eigen::Ref<VectorX> impulse);
  void add_to_report(int island);
};

Solver::Solver() : impl_(std::make_unique<Impl>()) {
  // Reserves memory, so that a longer history than before does not allocate in the middle of a run.
  impl_->report.residual_history.reserve(kUsualHistory);
  impl_->report.softened.reserve(kUsualSoftened);
  impl_->report.unfinished.reserve(kUsualSoftened);
}
void Solver::use(ThreadPool* pool) { impl_->pool = pool; }

Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

IslandSolver::Result Worker::solve(const Problem& problem, const Settings& settings,
                                   const Islands& islands, int island, Eigen::Ref<VectorX> w_all,
                                   Eigen::Ref<VectorX> impulse) {
  system.load(problem, islands.blocks(island), islands.constraints(island), settings.factorization);
  w.resize(system.size());
  f.resize(system.num_rows());
  system.gather(w_all.data(), w.data());
  for (const auto& c : system.constraints())
    std::copy_n(impulse.data() + c.global_row, c.law.rows, f.data() + c.row);
  IslandSolver::Result result;
  if (system.diagonal_positive()) {
    result = island_solver.solve(system, settings, w, f);
    if (const Rank own{-result.iterations, island}; own < rank) {
      rank = own;
      history = island_solver.totals().residual_history;
    }
  } else {
    result.status = Status::kSingular;
    std::fill(f.begin(), f.end(), 0.0);
  }
  system.scatter(w.data(), w_all.data());
  for (const auto& c : system.constraints()) {
    std::copy(f.data() + c.row, f.data() + c.row + c.law.rows, impulse.data() + c.global_row);
  }
  return result;
}

void Solver::Impl::solve_islands(const Problem& problem, const Settings& settings,
                                 Eigen::Ref<VectorX> w, Eigen::Ref<VectorX> impulse) {
  const int count = islands.count();
  const size_t threads = pool != nullptr ? pool->size() : 1;
  while (workers.size() < threads) workers.push_back(std::make_unique<Worker>());
  for (const auto& worker : workers) worker->rank = Worker::kNone;
  results.resize(count);
  evaluations.resize(count);
  const auto solve = [&](int island, int thread) {
    Worker& worker = *workers[thread];
    results[island] = worker.solve(problem, settings, islands, island, w, impulse);
    evaluations[island] = worker.island_solver.totals().line_search_evaluations;
  };
  share(pool, count, solve);
  for (int island = 0; island < count; ++island) add_to_report(island);
  const auto longest =
      std::min_element(workers.begin(), workers.end(),
                       [](const auto& a, const auto& b) { return a->rank < b->rank; });
  if ((*longest)->rank != Worker::kNone) report.residual_history = (*longest)->history;
}

void Solver::Impl::add_to_report(int island) {
  const IslandSolver::Result& result = results[island];
  report.status = std::max(report.status, result.status);  // the later in the enum, the worse
  report.iterations = std::max(report.iterations, result.iterations);
  report.total_iterations += result.iterations;
  report.method = std::max(report.method, result.method);
  report.line_search_evaluations += evaluations[island];
  report.residual = std::max(report.residual, result.residual);
  if (result.softness.any())
    report.softened.push_back({islands.blocks(island)[0], result.softness});
  if (result.status == Status::kUnfinished) report.unfinished.push_back(islands.blocks(island)[0]);
}

const Report& Solver::solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                            VectorX& impulse) {
  impulse.resize(problem.num_rows());
  return solve(problem, settings, w, Eigen::Ref<VectorX>(impulse));
}

const Report& Solver::solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                            Eigen::Ref<VectorX> impulse) {
  Impl& m = *impl_;
  Report& report = m.report;
  report.status = check(problem, w);
  report.iterations = report.total_iterations = report.islands = report.line_search_evaluations = 0;
  report.residual = 0.0;
  report.softened.clear();
  report.unfinished.clear();
  report.method = Method::kVelocity;
  report.residual_history.clear();
  if (!settings.warm) impulse.setConstant(std::numeric_limits<double>::quiet_NaN());
  if (report.status != Status::kConverged) {
    impulse.setZero();
    return report;
  }

  m.islands.compute(problem, settings.split_islands);
  report.islands = m.islands.count();
  m.solve_islands(problem, settings, w, impulse);
  // Blocks without constraints move freely, w+ = w*.
  for (int b = 0; b < problem.num_blocks(); ++b) {
    if (m.islands.constrained(b)) continue;
    const int start = problem.block_start(b), n = problem.block_size(b);
    w.segment(start, n) = problem.free_velocity().segment(start, n);
  }
  return report;
}

}  // namespace counterpoint::contact
