#include "counterpoint/contact/island_solver.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::contact {
namespace {

// Newton's method on velocities goes on where its residual is below this: quadratic convergence is
// at work;
constexpr double kNearly = 0.3;
constexpr int kFinishSteps = 20;
// in a few steps at a time, as long as these bring the residual to that share.
constexpr int kStageSteps = 3;
constexpr double kContraction = 0.1;
constexpr int kMixedSteps = 25;
constexpr int kInteriorSteps = 60;
// One curve of the homotopy; those that arrive take a hundred, the longest seen 746.
constexpr int kHomotopySteps = 1000;
// Where the homotopy was lost it goes again, otherwise and more carefully: of the hardest problems
// known each of these solves some that the others do not.
constexpr HomotopyManner kManner = {MixedSystem::kSigma, 0.5, 0};
constexpr HomotopyManner kMoreManners[] = {{0.05, 0.9, 0}, {MixedSystem::kSigma, 0.9, 0}};
constexpr HomotopyManner kDetours[] = {
    {MixedSystem::kSigma, 0.5, 1}, {0.05, 0.9, 2}, {MixedSystem::kSigma, 0.9, 3}};
// The islands of regularizers so many times as large whose solutions may lead to this one's.
constexpr double kSofter[] = {8.0, 128.0};
constexpr double kNeighbors[] = {0.5, 2.0, 8.0};
// Near ones: whether the mixed method arrives is a throw of dice, each of these another one.
constexpr double kNear[] = {1.03, 0.97, 1.06, 0.94, 1.09, 0.91, 1.13, 0.89, 1.16, 0.86,
                            1.20, 0.83, 1.23, 0.81, 1.27, 0.79, 1.31, 0.76, 1.35, 0.74};
constexpr int kNearSteps = 60;
// From a solution so much softer one walks to the own regularizers: by steps of their logarithm
// that double when the mixed method arrives and shrink when it does not, down to the shortest.
constexpr double kWalkFrom = 128.0;
constexpr double kWalkShrink = 0.4, kShortestWalk = 1e-3;
constexpr int kMostWalks = 40;
constexpr int kLastDirectSteps = 300;

}  // namespace

void IslandSolver::reserve() {
  mixed_system_.reserve(*system_);
  mixed_newton_.reserve(*system_);
  interior_point_.reserve(*system_);
  homotopy_.reserve(*system_);
  for (auto* point : {&point_, &here_}) point->reserve(*system_);
  for (auto* v : {&start_, &w_, &best_w_}) v->reserve(system_->size());
  for (auto* v : {&f_, &best_f_}) v->reserve(system_->num_rows());
  regularizer_.reserve(system_->constraints().size());
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

// point_ becomes the start, with impulses guessed there for the laws as they are.
void IslandSolver::guess_point() {
  mixed_system_.begin(*system_);
  point_.w = start_;
  mixed_system_.guess(point_.phi);
}

// From point_; true if it arrives.
bool IslandSolver::run_mixed_newton(int max_iterations) {
  const auto result =
      mixed_newton_.run(mixed_system_, std::min(max_iterations, steps_left()), point_);
  newton_.count(result.iterations);
  if (result.solved) w_ = point_.w;
  return result.solved;
}

// From the start. What it finds is as near as a gap of its own can be, which Newton's method on
// velocities, with kinks as narrow as the regularizer, may miss: the mixed method takes it there.
bool IslandSolver::run_interior_point(int max_iterations) {
  w_ = start_;
  const int steps = interior_point_.run(*system_, std::min(max_iterations, steps_left()), w_);
  newton_.count(steps < 0 ? -steps - 1 : steps);
  if (steps < 0) return false;
  mixed_system_.begin(*system_);
  point_.w = w_;
  mixed_system_.scale_impulses(interior_point_.impulses(), point_.phi);
  run_mixed_newton(kMixedSteps);
  return true;
}

// From the start.
bool IslandSolver::run_homotopy(const HomotopyManner& manner, int max_iterations) {
  mixed_system_.begin(*system_, manner.sigma_share, manner.detour);
  point_.w = start_;
  const auto result =
      homotopy_.run(mixed_system_, mixed_newton_, manner.least_cosine,
                    std::min({kHomotopySteps, max_iterations, steps_left()}), point_);
  newton_.count(result.iterations);
  w_ = point_.w;
  return result.solved;
}

// Another method from the start, and Newton's from where it arrives.
void IslandSolver::attempt(Method method, int max_iterations) {
  method_ = method;
  bool arrived = false;
  switch (method) {
    case Method::kNewton:
      w_ = start_;
      return finish(max_iterations);
    case Method::kMixedNewton:
      guess_point();
      arrived = run_mixed_newton(max_iterations);
      break;
    case Method::kInteriorPoint:
      arrived = run_interior_point(max_iterations);
      break;
    case Method::kHomotopy:
      arrived = run_homotopy(kManner, max_iterations);
      break;
  }
  if (arrived) finish(kFinishSteps);
}

// The regularizers become so many times those kept in regularizer_.
void IslandSolver::scale_regularizers(double factor) {
  auto own = regularizer_.begin();
  for (auto& c : system_->constraints()) c.law.regularizer = factor * *own++;
  mixed_system_.begin(*system_);
}

// From the solution in point_ for regularizers `factor` times as large to that for the own ones: in
// one go, or by shorter and longer steps. True if it arrives.
bool IslandSolver::walk_from(double factor, int most_steps) {
  double left = std::log(factor), step = left;
  bool arrived = false;
  for (int i = 0; i < most_steps && !arrived && steps_left() > 0; ++i) {
    here_ = point_;
    scale_regularizers(std::exp(left - step));
    if (run_mixed_newton(kMixedSteps)) {
      left -= step;
      arrived = left == 0.0;
      step = std::abs(2.0 * step) < std::abs(left) ? 2.0 * step : left;
    } else {
      point_ = here_;
      step *= kWalkShrink;
      if (std::abs(step) < kShortestWalk) break;
    }
  }
  return arrived;
}

// From the solution of the island whose regularizers are so many times as large, by `method`, with
// the mixed method to the own one.
void IslandSolver::come_from(double factor, Method method, int max_steps, int most_walks) {
  method_ = method;
  regularizer_.clear();
  for (const auto& c : system_->constraints()) regularizer_.push_back(c.law.regularizer);
  scale_regularizers(factor);
  if (method != Method::kHomotopy) guess_point();
  const bool there =
      method == Method::kHomotopy ? run_homotopy(kManner, max_steps) : run_mixed_newton(max_steps);
  const bool arrived = there && walk_from(factor, most_walks);
  scale_regularizers(1.0);
  if (arrived) finish(kFinishSteps);
}

void IslandSolver::follow_in_turn(std::span<const HomotopyManner> manners) {
  for (const HomotopyManner& manner : manners) {
    if (!unsolved()) return;
    method_ = Method::kHomotopy;
    if (run_homotopy(manner, kHomotopySteps)) finish(kFinishSteps);
  }
}

// From the cheapest to the surest.
void IslandSolver::try_in_turn() {
  finish(0);
  finish_while_contracting();
  if (unsolved()) attempt(Method::kMixedNewton, kMixedSteps);
  if (unsolved()) attempt(Method::kInteriorPoint, kInteriorSteps);
  for (const double factor : kSofter)
    if (unsolved()) come_from(factor, Method::kMixedNewton, kMixedSteps);
  if (unsolved()) attempt(Method::kHomotopy, kHomotopySteps);
  if (unsolved()) come_from(kWalkFrom, Method::kMixedNewton, kMixedSteps, kMostWalks);
  for (const double factor : kNear)
    if (unsolved()) come_from(factor, Method::kMixedNewton, kNearSteps);
  for (const double factor : kNeighbors)
    if (unsolved()) come_from(factor, Method::kHomotopy, kHomotopySteps, kMostWalks);
  follow_in_turn(kMoreManners);
  if (unsolved()) attempt(Method::kNewton, kLastDirectSteps);
  follow_in_turn(kDetours);
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
    if (*settings.only == Method::kHomotopy) follow_in_turn(kMoreManners);
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
