#include "counterpoint/contact/island_solver.h"

#include <algorithm>

namespace counterpoint::contact {
namespace {

// Newton's method on velocities is given this many steps before others are tried,
constexpr int kDirectSteps = 2;
// and more when the residual has come below this: quadratic convergence is at work.
constexpr double kNearly = 0.3;
constexpr int kFinishSteps = 20;
// Such steps are taken few at a time, as long as these bring the residual to that share.
constexpr int kStageSteps = 3;
constexpr double kContraction = 0.1;
constexpr int kMixedSteps = 25;
constexpr int kMixedRaises = 2;
constexpr int kInteriorSteps = 60;
// Where the homotopy was lost it goes again, otherwise and more carefully: of the hardest problems
// known each of these solves some that the others do not.
constexpr HomotopyManner kManners[] = {
    {MixedSystem::kSigma, 0.5, 0}, {0.05, 0.9, 0}, {MixedSystem::kSigma, 0.9, 0}};
constexpr HomotopyManner kDetours[] = {
    {MixedSystem::kSigma, 0.5, 1}, {0.05, 0.9, 2}, {MixedSystem::kSigma, 0.9, 3}};
constexpr int kLastDirectSteps = 300;

}  // namespace

void IslandSolver::reserve() {
  mixed_system_.reserve(*system_);
  mixed_newton_.reserve(*system_);
  interior_point_.reserve(*system_);
  homotopy_.reserve(*system_);
  point_.reserve(*system_);
  for (auto* v : {&start_, &w_, &best_w_}) v->reserve(system_->size());
  for (auto* v : {&f_, &best_f_}) v->reserve(system_->num_rows());
}

int IslandSolver::steps_left() const {
  return std::max(0, settings_.max_iterations - newton_.totals().iterations);
}

bool IslandSolver::unsolved() const {
  return !succeeded(result_.status) && result_.status != Status::kNotFinite && steps_left() > 0;
}

// Newton's method on velocities from w_; keeps the best point.
void IslandSolver::finish(int max_iterations) {
  result_ = newton_.run(settings_.tolerance, std::min(max_iterations, steps_left()), w_, f_);
  if (!best_w_.empty() && !(succeeded(result_.status) || result_.residual < best_.residual)) return;
  best_ = result_;
  best_w_ = w_;
  best_f_ = f_;
}

// The homotopy from the start, in all the steps that are left, and Newton's method from its end.
void IslandSolver::follow(const HomotopyManner& manner) {
  mixed_system_.begin(*system_, manner.sigma_share, manner.detour);
  point_.w = start_;
  const auto result =
      homotopy_.run(mixed_system_, mixed_newton_, manner.least_cosine, steps_left(), point_);
  newton_.count(result.iterations);
  w_ = point_.w;
  if (result.solved) finish(kFinishSteps);
}

void IslandSolver::follow_in_turn(std::span<const HomotopyManner> manners) {
  method_ = Method::kHomotopy;
  for (const HomotopyManner& manner : manners) {
    follow(manner);
    if (!unsolved()) return;
  }
}

// Newton's method goes on while its residual falls fast. That it is small says little by itself: it
// is relative to the island's momentum, and joints with friction have but a small share in a body's
// fall.
void IslandSolver::finish_while_contracting() {
  double before = kNearly;
  for (int steps = 0; steps < kFinishSteps && unsolved() && result_.residual < before;
       steps += kStageSteps) {
    before = kContraction * result_.residual;
    finish(kStageSteps);
  }
}

// Another method from the start, and Newton's from where it arrives.
void IslandSolver::attempt(Method method, int max_iterations) {
  method_ = method;
  const int allowed = std::min(max_iterations, steps_left());
  bool solved = false;
  w_ = start_;
  if (method == Method::kNewton) return finish(allowed);
  if (method == Method::kHomotopy) return follow_in_turn(kManners);
  if (method == Method::kInteriorPoint) {
    const int steps = interior_point_.run(*system_, allowed, w_);
    solved = steps >= 0;
    newton_.count(solved ? steps : -steps - 1);
  } else {
    mixed_system_.begin(*system_);
    point_.w = start_;
    mixed_system_.guess(point_.phi);
    const auto result = mixed_newton_.run(mixed_system_, allowed, kMixedRaises, point_);
    solved = result.solved;
    newton_.count(result.iterations);
    w_ = point_.w;
  }
  if (solved) finish(kFinishSteps);
}

// From the cheapest to the surest; Newton's method again when these have failed, whose cost cannot
// rise; other curves to the same solutions at last.
void IslandSolver::try_in_turn() {
  finish(kDirectSteps);
  finish_while_contracting();
  if (unsolved()) attempt(Method::kMixedNewton, kMixedSteps);
  if (unsolved()) attempt(Method::kInteriorPoint, kInteriorSteps);
  if (unsolved()) attempt(Method::kHomotopy, settings_.max_iterations);
  if (unsolved()) attempt(Method::kNewton, kLastDirectSteps);
  if (unsolved()) follow_in_turn(kDetours);
}

Newton::Result IslandSolver::solve(IslandSystem& system, const Settings& settings,
                                   std::vector<double>& w, std::vector<double>& f) {
  system_ = &system;
  reserve();
  settings_ = settings;
  method_ = Method::kNewton;
  best_w_.clear();
  f_.resize(f.size());
  newton_.begin(system);
  newton_.choose_start(w);
  start_ = w_ = w;
  if (settings.only) {
    attempt(*settings.only, settings.max_iterations);
    if (best_w_.empty()) finish(0);
  } else {
    try_in_turn();
  }
  w = best_w_;
  f = best_f_;
  if (!succeeded(best_.status) && best_.status != Status::kNotFinite)
    best_.status = steps_left() == 0 ? Status::kMaxIterations : Status::kNoProgress;
  best_.iterations = newton_.totals().iterations;
  return best_;
}

}  // namespace counterpoint::contact
