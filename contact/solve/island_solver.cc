#include "counterpoint/contact/solve/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

// Ratio of sigma in the mixed method to the inverse mass at a constraint: without added smoothing,
// and along a path of smoothing.
constexpr double kSigma = 1.0, kPathSigma = 0.2;

// Limits on steps of the mixed method: kWarmSteps at first; then, in each turn, steps without added
// smoothing and steps along a path of smoothing, after a number of Gauss-Seidel sweeps.
constexpr int kWarmSteps = 8;
constexpr struct {
  int sweeps, near_steps, path_steps;
} kTurns[] = {{15, 4, 0}, {60, 0, 40}, {240, 12, 40}};
// A path starts after kSmoothSweeps sweeps with its first smoothing, which is the square of kSmooth
// times the scale of the residual: more smoothing would lose the result of the earlier sweeps.
constexpr int kSmoothSweeps = 10;
constexpr double kSmooth = 0.01;
// Limits where softer laws are not allowed: steps of a path; the sigmas of paths that start without
// impulses, and their first smoothing as a share of the residual.
constexpr int kLongPathSteps = 400;
constexpr double kSigmasFromNothing[] = {0.2, 3.0, 0.05};
constexpr double kMuchSmooth = 0.316;
// Changes of an impulse that sweeps skip, as a share of the scale of the residual or, on a path, of
// the square root of the smoothing.
constexpr double kNegligible = 1e-7, kNegligibleSmooth = 1e-3;
// Islands of free bodies with kManyRows rows or more begin with sweeps, unless the relative
// residual is below kNearShare.
constexpr int kManyRows = 60, kFreeBodySize = 6, kFirstSweeps = 10;
constexpr double kNearShare = 1e-2;
// Newton's method on velocities starts if the relative residual is below kNearly, and continues
// while each stage of kStageSteps steps reduces it to kContraction of its value, for about
// kFinishSteps steps. These also limit the steps that finish a mixed method.
constexpr double kNearly = 0.3, kContraction = 0.1;
constexpr int kStageSteps = 3, kFinishSteps = 20;
// Expected share of the residual after a velocity step with the last factors of a mixed method that
// has converged.
constexpr double kMixedContraction = 1e-3;
// Relative residual below which Newton's method on velocities also continues from an unsolved mixed
// method: only its laws, which are not widened, resolve which of several lightly loaded corners
// slips.
constexpr double kUseful = 3e-2;

// Softer laws are convex. First they are only kLittleSofter times softer, for kLittleSteps Newton
// steps, so that bodies standing on light ones do not sink into them and jam. Then contacts get the
// compliance kSoftCompliance: hard enough that a body standing on them for a few steps hardly sinks
// (4e-3 g h^2), soft enough that Newton's method takes about ten steps, or a hundred where masses
// differ by 1e8. kSoftest limits the factor.
constexpr double kLittleSofter = 32.0, kSoftCompliance = 4e-3, kSoftest = 32768.0;
constexpr int kLittleSteps = 80, kConvexSteps = 500;
// Where rounding hides the minimum, laws become kSofterAgain times softer repeatedly, until almost
// only inertia is left, whose minimum takes one step.
constexpr double kSofterAgain = 1024.0, kNothingLeft = 1e30;

// Where softer laws are not allowed, they start a continuation back to the given laws in at most
// kMostStages stages: at first all in one; after a failure a stage is shortened to kStageShrink of
// its logarithm.
constexpr int kMostStages = 40;
constexpr double kStageShrink = 0.4;
constexpr int kBackSteps = 60;

}  // namespace

void IslandSolver::begin(IslandSystem& system, const Settings& settings,
                         const std::vector<double>& w, const std::vector<double>& guess) {
  system_ = &system;
  tolerance_ = settings.tolerance;
  exact_ = settings.soften_after == 0;
  max_iterations_ = settings.max_iterations;
  budget_ = exact_ ? max_iterations_ : std::min(max_iterations_, settings.soften_after);
  softness_ = {};
  mixed_system_.reserve(system);
  mixed_newton_.reserve(system);
  sweeps_.reserve(system);
  for (auto* point : {&point_, &here_}) point->reserve(system);
  for (auto* v : {&start_, &w_, &best_w_, &own_best_w_}) v->reserve(system.size());
  for (auto* v : {&guess_, &f_, &best_f_}) v->reserve(system.num_rows());
  own_.reserve(system.constraints().size());
  best_w_.clear();
  guess_ = guess;
  f_.resize(guess.size());
  newton_.begin(system);
  start_ = w;
  newton_.choose_start(start_, f_);
}

int IslandSolver::allowed(int steps) const {
  return std::clamp(budget_ - newton_.totals().iterations, 0, steps);
}

// Runs Newton's method on velocities from w_ and keeps the best point. True if it converges.
bool IslandSolver::finish(int max_iterations, double contraction) {
  last_ = newton_.run(tolerance_, allowed(max_iterations), w_, f_, contraction);
  return keep_best();
}

// Continues where the last finish() or resume() ended.
bool IslandSolver::resume(int max_iterations) {
  last_ = newton_.resume(tolerance_, allowed(max_iterations), w_, f_);
  return keep_best();
}

bool IslandSolver::keep_best() {
  const bool arrived = succeeded(last_.status);
  // A solution is replaced only by another one: residuals of different laws are not comparable.
  const bool better = !succeeded(best_.status) && last_.residual < best_.residual;
  if (arrived || best_w_.empty() || better) {
    best_ = last_;
    best_w_ = w_;
    best_f_ = f_;
  }
  return arrived;
}

// Continues while the residual falls fast. A small residual alone says little: it is relative to
// the island's momentum, of which joints with friction have only a small share in a falling body.
bool IslandSolver::run_velocity() {
  w_ = start_;
  bool arrived = resume(0);
  double before = kNearly;
  for (int steps = 0; steps < kFinishSteps && !arrived && last_.residual < before;
       steps += kStageSteps) {
    before = kContraction * last_.residual;
    arrived = resume(kStageSteps);
  }
  return arrived;
}

void IslandSolver::start_mixed(double sigma) {
  mixed_system_.begin(*system_, sigma);
  sweeps_.begin(*system_);
  point_.w = start_;
  mixed_system_.guess(guess_, point_.phi);
}

// Finishes the result of a mixed method by Newton's method on velocities.
bool IslandSolver::finish_mixed(const MixedNewton::Result& result) {
  newton_.count(result.iterations);
  if (!result.solved && !(result.residual < kUseful)) return false;
  w_ = point_.w;
  return finish(kFinishSteps, result.solved && result.iterations > 0 ? kMixedContraction : 1.0);
}

bool IslandSolver::run_near(int max_iterations) {
  return finish_mixed(mixed_newton_.run_near(mixed_system_, allowed(max_iterations), point_));
}

// Returns whether to begin with sweeps. They are cheap beside Newton steps for many free bodies,
// but not for a tree, all of which responds to each impulse. With Coulomb friction they need a
// guess: without one they carry the loads of a tower from level to level and leave more error in
// friction than Newton's method can correct.
bool IslandSolver::sweeps_pay() const {
  const auto& blocks = system_->blocks();
  const auto& constraints = system_->constraints();
  const auto is_known = [this](const auto& c) { return !std::isnan(guess_[c.row]); };
  return system_->num_rows() >= kManyRows &&
         std::all_of(blocks.begin(), blocks.end(),
                     [](const auto& b) { return b.size <= kFreeBodySize; }) &&
         (!system_->unsymmetric() || std::any_of(constraints.begin(), constraints.end(), is_known));
}

// Runs the mixed method along a path of smoothing that begins near the point.
bool IslandSolver::run_path(int max_iterations) {
  residual();  // sets the scale
  const double start = smoothing(kSmooth);
  mixed_system_.begin(*system_, kPathSigma);
  sweeps_.run(kSmoothSweeps, start, kNegligibleSmooth * std::sqrt(start), point_);
  const int steps = allowed(max_iterations);
  return finish_mixed(mixed_newton_.run_path(mixed_system_, steps, start, point_));
}

// Returns the smoothing of each law [J] whose sum over the laws is the square of `share` times the
// scale of the residual.
double IslandSolver::smoothing(double share) {
  const double size = share * mixed_system_.scale();
  return size * size / std::max(1, mixed_system_.num_laws());
}

// Returns the residual relative to its scale.
double IslandSolver::residual() {
  const double norm = mixed_system_.residual(point_);
  return norm / mixed_system_.scale();
}

void IslandSolver::sweep(int count, double enough) {
  mixed_system_.begin(*system_, kSigma);
  if (!std::isfinite(residual())) start_mixed(kSigma);
  sweeps_.start(point_);
  if (residual() < enough) return;
  sweeps_.run(count, 0.0, kNegligible * mixed_system_.scale(), point_);
}

// Starts from the impulses of the last step. Newton's method converges fast once it knows which
// contacts carry and slide; sweeps find that from almost anywhere.
bool IslandSolver::run_mixed() {
  start_mixed(kSigma);
  if (sweeps_pay() && !(residual() < kNearShare)) sweep(kFirstSweeps, kNearShare);
  if (run_near(kWarmSteps)) return true;
  for (const auto& turn : kTurns) {
    sweep(turn.sweeps, 0.0);
    if (turn.near_steps > 0 && run_near(turn.near_steps)) return true;
    if (turn.path_steps > 0 && run_path(exact_ ? kLongPathSteps : turn.path_steps)) return true;
  }
  return exact_ && run_from_nothing();
}

// Starts from the impulses that would stop each constraint by itself, with more smoothing.
bool IslandSolver::run_from_nothing() {
  std::fill(guess_.begin(), guess_.end(), std::numeric_limits<double>::quiet_NaN());
  for (const double sigma : kSigmasFromNothing) {
    start_mixed(sigma);
    const double start = smoothing(kMuchSmooth * residual());
    const int steps = allowed(kLongPathSteps);
    if (finish_mixed(mixed_newton_.run_path(mixed_system_, steps, start, point_))) return true;
  }
  return false;
}

void IslandSolver::set_softness(Softness softness) {
  softness_ = softness;
  auto own = own_.begin();
  for (auto& c : system_->constraints()) c.law = soften(*own++, softness);
  system_->laws_changed();
}

// Returns the factor, at most kSoftest, that brings the softest contact or limit to
// kSoftCompliance.
double IslandSolver::softer_factor() const {
  double softest = 0.0;
  for (const auto& c : system_->constraints())
    if (is_one_sided(c.law.type) && c.inverse_mass > 0.0)
      softest = std::max(softest, c.law.regularizer / c.inverse_mass);
  return softest > 0.0 ? std::clamp(kSoftCompliance / softest, 1.0, kSoftest) : kSoftest;
}

bool IslandSolver::solve_softer(double factor, int max_iterations) {
  budget_ = std::min(max_iterations_, budget_ + max_iterations);
  set_softness({factor, true});
  w_ = start_;
  best_w_.clear();
  return finish(max_iterations);
}

// Solves with softer laws, whose cost has a minimum that a line search finds from anywhere.
bool IslandSolver::run_softer() {
  own_.clear();
  for (const auto& c : system_->constraints()) own_.push_back(c.law);
  own_best_w_ = best_w_;
  const double most = exact_ ? kSoftest : softer_factor();
  bool arrived = !exact_ && most > kLittleSofter && solve_softer(kLittleSofter, kLittleSteps);
  if (!arrived) arrived = solve_softer(most, kConvexSteps);
  for (double factor = kSofterAgain * most; !exact_ && !arrived && factor < kNothingLeft;
       factor *= kSofterAgain)
    arrived = solve_softer(factor, kLittleSteps);
  if (!exact_) return arrived;
  if (arrived) walk_back();
  if (!softness_.any()) return true;
  // The result is the best point of all, judged by the given laws.
  set_softness({});
  w_ = best_w_;
  best_w_.clear();
  finish(0);
  w_ = own_best_w_;
  return (!w_.empty() && finish(0)) || succeeded(best_.status);
}

// Continues from the softest laws back to the given ones; the length of the stages adapts.
void IslandSolver::walk_back() {
  point_.w = best_w_;
  mixed_system_.begin(*system_, kSigma);
  mixed_system_.guess(best_f_, point_.phi);
  double left = std::log(softness_.factor), stage = left;
  for (int i = 0; i < kMostStages && softness_.any(); ++i) {
    here_ = point_;
    const Softness reached = softness_;
    const double next = left > stage ? left - stage : 0.0;
    set_softness({next > 0.0 ? std::exp(next) : 1.0, false});
    mixed_system_.begin(*system_, kSigma);
    const double start = smoothing(kMuchSmooth * residual());
    const auto result = mixed_newton_.run_path(mixed_system_, allowed(kBackSteps), start, point_);
    newton_.count(result.iterations);
    w_ = point_.w;
    if (result.solved && finish(kFinishSteps)) {
      left = next;
      stage = std::min(2.0 * stage, left);
    } else {
      point_ = here_;
      set_softness(reached);
      stage *= kStageShrink;
    }
  }
}

bool IslandSolver::run(Method method) {
  switch (method) {
    case Method::kVelocity:
      return run_velocity();
    case Method::kMixed:
      return run_mixed();
    case Method::kSofter:
      return run_softer();
  }
  return false;
}

IslandSolver::Result IslandSolver::solve(IslandSystem& system, const Settings& settings,
                                         std::vector<double>& w, std::vector<double>& f) {
  constexpr Method kPlan[] = {Method::kVelocity, Method::kMixed, Method::kSofter};
  begin(system, settings, w, f);
  Result result;
  bool arrived = false;
  for (const Method method : kPlan) {
    if (settings.only && *settings.only != method) continue;
    result.method = method;
    arrived = run(method);
    if (arrived || best_.status == Status::kNotFinite) break;
  }
  if (best_w_.empty()) {
    w_ = start_;
    finish(0);
  }
  w = best_w_;
  f = best_f_;
  result.status = best_.status;
  if (arrived && softness_.any()) result.status = Status::kSoftened;
  if (!arrived && best_.status != Status::kNotFinite)
    result.status = allowed(1) == 0 ? Status::kMaxIterations : Status::kNoProgress;
  result.residual = best_.residual;
  result.iterations = newton_.totals().iterations;
  result.softness = softness_;
  return result;
}

}  // namespace counterpoint::contact
