#include "counterpoint/contact/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/island_solver.h"
#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/islands.h"

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
      "converged",   "round-off floor", "softened",   "unfinished",
      "iteration limit", "no progress", "not finite", "singular mass matrix",
      "invalid law", "invalid state",   "diverged"};
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

struct Solver::Impl {
  Islands islands;
  IslandSystem system;
  IslandSolver island_solver;
  std::vector<double> w, f;
  Report report;

  void solve_island(const Problem& problem, const Settings& settings, int island,
                    Eigen::Ref<VectorX> w_all, Eigen::Ref<VectorX> impulse);
};

Solver::Solver() : impl_(std::make_unique<Impl>()) {
  // Reserves memory, so that a longer history than before does not allocate in the middle of a run.
  impl_->report.residual_history.reserve(kUsualHistory);
  impl_->report.softened.reserve(kUsualSoftened);
  impl_->report.unfinished.reserve(kUsualSoftened);
}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

void Solver::Impl::solve_island(const Problem& problem, const Settings& settings, int island,
                                Eigen::Ref<VectorX> w_all, Eigen::Ref<VectorX> impulse) {
  system.load(problem, islands.blocks(island), islands.constraints(island), settings.factorization);
  w.resize(system.size());
  f.resize(system.num_rows());
  system.gather(w_all.data(), w.data());
  for (const auto& c : system.constraints())
    std::copy_n(impulse.data() + c.global_row, c.law.rows, f.data() + c.row);
  IslandSolver::Result result;
  if (system.diagonal_positive()) {
    result = island_solver.solve(system, settings, w, f);
  } else {
    result.status = Status::kSingular;
    std::fill(f.begin(), f.end(), 0.0);
  }
  system.scatter(w.data(), w_all.data());
  for (const auto& c : system.constraints()) {
    std::copy(f.data() + c.row, f.data() + c.row + c.law.rows, impulse.data() + c.global_row);
  }
  report.status = std::max(report.status, result.status);  // the later in the enum, the worse
  const Newton::Totals& totals = island_solver.totals();
  if (report.residual_history.empty() || result.iterations > report.iterations) {
    report.iterations = result.iterations;
    report.residual_history = totals.residual_history;
  }
  report.total_iterations += result.iterations;
  report.method = std::max(report.method, result.method);
  report.line_search_evaluations += totals.line_search_evaluations;
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
  for (int island = 0; island < m.islands.count(); ++island) {
    m.solve_island(problem, settings, island, w, impulse);
  }
  // Blocks without constraints move freely, w+ = w*.
  for (int b = 0; b < problem.num_blocks(); ++b) {
    if (m.islands.constrained(b)) continue;
    const int start = problem.block_start(b), n = problem.block_size(b);
    w.segment(start, n) = problem.free_velocity().segment(start, n);
  }
  return report;
}

}  // namespace counterpoint::contact
