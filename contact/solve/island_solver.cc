#include "counterpoint/contact/solve/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

// Ratio of sigma to the inverse mass at a constraint along a path of smoothing; 1 without.
constexpr double kPathSigma = 0.2;

// The mixed method begins with kTurnSteps steps. Turns follow, each of twice as many steps n as the
// one before: n^2 / kTurnSteps sweeps (m sweeps carry a load over about the root of m contacts),
// then n / 4 steps without added smoothing and, from the second turn on, a path of n
// (restarts of doubled length: M. Luby, A. Sinclair, D. Zuckerman, "Optimal speedup of Las Vegas
// algorithms", 1993). The Newton steps granted end them; where softer laws are not allowed, so does
// a turn of kMostTurnSteps.
constexpr int kTurnSteps = 8, kMostTurnSteps = 256;
// Relative residual that sweeps reach from almost anywhere: islands of free bodies begin with
// sweeps above it, and after kTurnSteps more sweeps the first smoothing of a path is the square of
// it times the scale of the residual. More smoothing would lose the result of the earlier sweeps.
constexpr double kSwept = 0.01;
constexpr int kFreeBodySize = 6;
// Relative residual below which Newton's method on velocities also continues from an unsolved mixed
// method: only its laws, which are not widened, resolve which of several lightly loaded corners
// slips.
constexpr double kUseful = 3e-2;
// Newton's method on velocities continues while a step halves the residual, for at most
// kFinishSteps steps. These also limit the steps that finish a mixed method.
constexpr int kFinishSteps = 20;

// Softer laws are convex. First they are only kLittleSofter times softer, for kSofterSteps Newton
// steps, so that bodies standing on light ones do not sink into them and jam. Then contacts get the
// compliance kSoftCompliance: hard enough that a body standing on them for a few steps hardly sinks
// (4e-3 g h^2), soft enough that Newton's method takes about ten steps, or a hundred where masses
// differ by 1e8. kSoftest limits the factor.
constexpr double kLittleSofter = 32.0, kSoftCompliance = 4e-3;
constexpr double kSoftest = kLittleSofter * kLittleSofter * kLittleSofter;
constexpr int kSofterSteps = 80;
// An unfinished island ends with kLastSweeps sweeps. If less than kWholeShare of its impulses can
// be kept without gain of energy, kSweepsFromGuess sweeps from the given impulses are tried, too.
constexpr int kLastSweeps = 8, kSweepsFromGuess = 16;
constexpr double kWholeShare = 0.9;
// Shortest stage of the continuation back to the given laws, in the logarithm of the factor.
constexpr double kLeastStage = 1e-3;

}  // namespace

void IslandSolver::begin(IslandSystem& system, const Settings& settings,
                         const std::vector<double>& w, const std::vector<double>& guess) {
  system_ = &system;
  tolerance_ = settings.tolerance;
  exact_ = settings.soften_after == 0;
  max_iterations_ = settings.max_iterations;
  const int granted = settings.stop_after > 0 ? settings.stop_after : settings.soften_after;
  budget_ = exact_ ? max_iterations_ : std::min(max_iterations_, granted);
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
  newton_.choose_start(is_loaded(), start_, f_);
}

// Returns whether a guess is a load beyond the kink of its one-sided law.
bool IslandSolver::is_loaded() const {
  const auto& constraints = system_->constraints();
  return std::any_of(constraints.begin(), constraints.end(), [this](const auto& c) {
    const double load = guess_[c.row];
    return is_one_sided(c.law.type) && load > 0.0 && c.inverse_mass * load * load > c.law.smoothing;
  });
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

// Continues while each step halves the residual. A small residual alone says little: it is relative
// to the island's momentum, of which joints with friction have only a small share in a falling
// body.
bool IslandSolver::run_velocity() {
  w_ = start_;
  bool arrived = resume(0);
  double before = kNearSolution;
  for (int steps = 0; steps < kFinishSteps && !arrived && last_.residual < before; ++steps) {
    before = 0.5 * last_.residual;
    arrived = resume(1);
  }
  return arrived;
}

void IslandSolver::start_mixed() {
  mixed_system_.begin(*system_, 1.0);
  sweeps_.begin(*system_);
  point_.w = start_;
  mixed_system_.guess(guess_, point_.phi);
}

// Finishes the result of a mixed method by Newton's method on velocities.
bool IslandSolver::finish_mixed(const MixedNewton::Result& result) {
  newton_.count(result.iterations);
  if (!result.solved && !(result.residual < kUseful)) return false;
  w_ = point_.w;
  // The last factors of a mixed method that has converged are those of the velocity step.
  return finish(kFinishSteps, result.solved && result.iterations > 0 ? 0.0 : 1.0);
}

bool IslandSolver::run_near(int max_iterations) {
  return finish_mixed(mixed_newton_.run_near(mixed_system_, allowed(max_iterations), point_));
}

// Returns whether to begin with sweeps. kTurnSteps of them are cheap beside Newton steps for more
// free bodies than that, but not for a tree, all of which responds to each impulse. With Coulomb
// friction they need a guess: without one they carry the loads of a tower from level to level and
// leave more error in friction than Newton's method can correct.
bool IslandSolver::sweeps_pay() const {
  const auto& blocks = system_->blocks();
  const auto& constraints = system_->constraints();
  const auto is_known = [this](const auto& c) { return !std::isnan(guess_[c.row]); };
  return blocks.size() > kTurnSteps &&
         std::all_of(blocks.begin(), blocks.end(),
                     [](const auto& b) { return b.size <= kFreeBodySize; }) &&
         (!system_->unsymmetric() || std::any_of(constraints.begin(), constraints.end(), is_known));
}

// Runs the mixed method along a path of smoothing that begins near the point.
bool IslandSolver::run_path(int max_iterations) {
  residual();  // sets the scale
  const double start = smoothing(kSwept);
  mixed_system_.begin(*system_, kPathSigma);
  sweeps_.run(kTurnSteps, start, negligible(), point_);
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

// Returns the change of an impulse [sqrt J] that sweeps skip: its square is lost to rounding beside
// that of the scale.
double IslandSolver::negligible() const {
  return std::sqrt(std::numeric_limits<double>::epsilon()) * mixed_system_.scale();
}

void IslandSolver::sweep(int count, double enough) {
  mixed_system_.begin(*system_, 1.0);
  if (!std::isfinite(residual())) start_mixed();
  sweeps_.start(point_);
  if (residual() < enough) return;
  sweeps_.run(count, 0.0, negligible(), point_);
}

// Starts from the impulses of the last step. Newton's method converges fast once it knows which
// contacts carry and slide; sweeps find that from almost anywhere.
bool IslandSolver::run_mixed() {
  start_mixed();
  if (sweeps_pay() && !(residual() < kSwept)) sweep(kTurnSteps, kSwept);
  if (run_near(kTurnSteps)) return true;
  for (int n = kTurnSteps; allowed(1) > 0 && n <= kMostTurnSteps; n *= 2) {
    sweep(n * n / kTurnSteps, 0.0);
    if (run_near(n / 4)) return true;
    if (n > kTurnSteps && run_path(n)) return true;
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

// Solves with softer laws, whose cost has a minimum that a line search finds from anywhere. Where
// rounding hides it, laws become softer by the square of kLittleSofter repeatedly, until almost
// only inertia is left, whose minimum takes one step.
bool IslandSolver::run_softer() {
  own_.clear();
  for (const auto& c : system_->constraints()) own_.push_back(c.law);
  own_best_w_ = best_w_;
  const double most = exact_ ? kSoftest : softer_factor();
  bool arrived = !exact_ && most > kLittleSofter && solve_softer(kLittleSofter, kSofterSteps);
  if (!arrived) arrived = solve_softer(most, max_iterations_);
  double factor = most;
  while (!exact_ && !arrived && allowed(1) > 0 && std::isfinite(factor)) {
    factor *= kLittleSofter * kLittleSofter;
    arrived = solve_softer(factor, max_iterations_);
  }
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

// Continues from the softest laws back to the given ones. A stage that fails is halved, one that
// succeeds doubled, until stages are shorter than kLeastStage.
void IslandSolver::walk_back() {
  point_.w = best_w_;
  mixed_system_.begin(*system_, 1.0);
  mixed_system_.guess(best_f_, point_.phi);
  double left = std::log(softness_.factor), stage = left;
  while (softness_.any() && stage > kLeastStage && allowed(1) > 0) {
    here_ = point_;
    const Softness reached = softness_;
    const double next = left > stage ? left - stage : 0.0;
    set_softness({next > 0.0 ? std::exp(next) : 1.0, false});
    mixed_system_.begin(*system_, 1.0);
    const double start = smoothing(0.1 * residual());
    const auto result = mixed_newton_.run_path(mixed_system_, allowed(kSofterSteps), start, point_);
    newton_.count(result.iterations);
    w_ = point_.w;
    if (result.solved && finish(kFinishSteps)) {
      left = next;
      stage = std::min(2.0 * stage, left);
    } else {
      point_ = here_;
      set_softness(reached);
      stage *= 0.5;
    }
  }
}

// Evaluates the impulses of the point, whose velocities must be those that they lead to.
MixedSystem::Dissipation IslandSolver::dissipation() {
  mixed_system_.begin(*system_, 1.0);
  residual();
  return mixed_system_.dissipation(point_);
}

// Ends with impulses that obey their laws roughly. Sweeps leave them in their cones; the share that
// dissipates most is kept.
void IslandSolver::stop() {
  sweep(kLastSweeps, 0.0);
  MixedSystem::Dissipation found = dissipation();
  if (found.share < kWholeShare) {
    here_ = point_;
    start_mixed();
    sweep(kSweepsFromGuess, 0.0);
    const MixedSystem::Dissipation from_guess = dissipation();
    if (from_guess.cost < found.cost) {
      found = from_guess;
    } else {
      point_ = here_;
    }
  }
  for (double& phi : point_.phi) phi *= found.share;
  sweeps_.start(point_);
  best_.status = Status::kUnfinished;
  best_.residual = residual();
  best_w_ = point_.w;
  best_f_ = mixed_system_.impulses();
}

bool IslandSolver::run(Method method) {
  switch (method) {
    case Method::kVelocity:
      return run_velocity();
    case Method::kMixed:
      return run_mixed();
    case Method::kSofter:
      return run_softer();
    case Method::kStop:
      stop();
      return true;
  }
  return false;
}

IslandSolver::Result IslandSolver::solve(IslandSystem& system, const Settings& settings,
                                         std::vector<double>& w, std::vector<double>& f) {
  begin(system, settings, w, f);
  const bool stops = settings.stop_after > 0 && !exact_;
  const Method plan[] = {Method::kVelocity, Method::kMixed,
                         stops ? Method::kStop : Method::kSofter};
  Result result;
  bool arrived = false;
  for (const Method method : plan) {
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
