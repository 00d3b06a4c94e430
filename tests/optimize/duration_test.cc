// Motions whose duration is an unknown, with known answers of the discrete equations.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::optimization::duration_test {
namespace {

constexpr int kSteps = 20;

Problem problem_of(const Scene& scene, int steps, double duration, DurationRange range) {
  Problem problem;
  problem.model = &scene.model;
  problem.options = scene.options;
  problem.options.mean_velocity_forces = false;
  problem.options.time_step = duration / steps;
  problem.steps = steps;
  problem.duration = range;
  problem.motors = motors_of(scene.model);
  problem.start_q = scene.q;
  problem.start_v = problem.goal_v = VectorX::Zero(scene.model.nv());
  return problem;
}

Term term_of(const Model& model, Quantity quantity, bool condition, FrameRange frames = {}) {
  Term term;
  term.quantity = quantity;
  term.name = quantity_name(quantity);
  term.weight = VectorX::Ones(rows_of(model, quantity));
  term.condition = condition;
  term.frames = frames;
  return term;
}

/// Nothing touches, so that one smoothing is enough. violation: limit of the conditions; landing:
/// required accuracy of forward steps [m, rad].
Result solve(const Problem& problem, const std::vector<VectorX>& start, double violation,
             double landing = 1e-8) {
  Settings settings;
  settings.threads = 1;
  settings.tolerance = 1e-12;
  settings.stage_iterations = 400;
  settings.violation_tolerance = violation;
  settings.continuation.start = settings.continuation.end.emplace(1e-6);
  const Result result = optimize(problem, start, settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  const Verification found =
      verify(*problem.model, result.options, problem.motors, result.q, result.v.front());
  EXPECT_LE(found.forward_check_max, landing);
  EXPECT_EQ(found.forward_failures, 0);
  return result;
}

double duration_of(const Result& result) {
  return result.options.time_step * static_cast<double>(result.applied_force.size());
}

// A ball leaves A with a given speed upwards and lands at B, at the same height. v_t = v_0 - t g h
// and sum v_t h = 0 give N h = 2 v_0 / g N / (N + 1).
TEST(Duration, OfAThrowFollowsFromTheSpeedAtItsStart) {
  constexpr double kUp = 4.0, kGravity = 9.81;
  const Scene scene = test::free_ball({.gravity = Vector3(0, 0, -kGravity)});
  const Model& model = scene.model;
  for (const double guess : {0.2, 0.6, 3.0}) {
    Problem problem = problem_of(scene, kSteps, guess, {0.1, 5.0});
    problem.free_start = true;
    Term at_a = term_of(model, Quantity::kConfiguration, true, {0, 0});
    at_a.target = scene.q;
    Term at_b = term_of(model, Quantity::kPosition, true, {-1, -1});
    at_b.body = 1;
    at_b.target = scene.q.head<3>() + Vector3(2, 0, 0);
    Term up = term_of(model, Quantity::kVelocity, true, {0, 0});
    up.weight = VectorX::Unit(model.nv(), 2);
    up.target = kUp * up.weight;
    Term turning = term_of(model, Quantity::kVelocity, false);
    turning.weight.head<3>().setZero();
    problem.terms = {unactuated_condition(model, problem.motors), at_a, at_b, up, turning};
    VectorX end = scene.q;
    end[0] += 2.0;
    const Result result = solve(problem, straight_line(model, scene.q, end, kSteps), 1e-9);
    // The conditions hold to 1e-9 of their sizes, which are of order one.
    EXPECT_NEAR(duration_of(result), 2.0 * kUp / kGravity * kSteps / (kSteps + 1), 1e-7) << guess;
  }
}

/// A block of 2 kg that goes by 1 m from rest to rest in 20 steps.
constexpr double kMass = 2.0, kForce = 8.0;
Problem block_of(const Scene& scene, double guess, DurationRange range) {
  Problem problem = problem_of(scene, kSteps, guess, range);
  problem.goal_q = VectorX::Ones(1);
  return problem;
}

// With the costs T^2 / 2 and a^2 / 2 sum u_t^2: u is linear in t, and the least sum for a given T
// is (m N^2 / T^2)^2 12 / (N (N^2 - 1)) =: C / T^4, so that T^6 = 2 a^2 C.
TEST(Duration, OfABlockBalancesTimeAndEffort) {
  constexpr double kEffort = 0.1;
  const double c = std::pow(kMass * kSteps * kSteps, 2) * 12.0 / (kSteps * (kSteps * kSteps - 1.0));
  const Scene scene = test::slider({.mass = kMass});
  for (const double guess : {0.5, 1.0, 4.0}) {
    Problem problem = block_of(scene, guess, {0.2, 5.0});
    Term effort = term_of(scene.model, Quantity::kAppliedForce, false);
    effort.weight *= kEffort;
    problem.terms = {term_of(scene.model, Quantity::kDuration, false), effort};
    const Result result =
        solve(problem, straight_line(scene.model, scene.q, *problem.goal_q, kSteps), 1e-6);
    // The cost is quadratic about the optimum, and known to 1e-12 of itself.
    EXPECT_NEAR(duration_of(result), std::pow(2.0 * kEffort * kEffort * c, 1.0 / 6.0), 1e-6)
        << guess;
    EXPECT_LT(result.iterations, 60) << guess;  // Newton's method, not a slow linear rate
  }
}

// With a force limit F the block goes as fast as it can: full force forwards, then backwards. With
// an even number of steps the discrete motion takes 2 sqrt(D m / F), too: v_t = t a h up to N / 2,
// and the sum of all v_t h is a h^2 N^2 / 4. The cost of effort falls from run to run, each of
// which starts from the last: where no limit acts, nothing else tells one force from another.
TEST(Duration, OfABlockWithAForceLimitIsThatOfBangBangControl) {
  constexpr double kExcess = 2.0;
  const double shortest = 2.0 * std::sqrt(kMass / kForce);
  const Scene scene = test::slider({.mass = kMass, .effort_limit = kForce});
  for (const double guess : {0.5, 1.5}) {
    Problem problem = block_of(scene, guess, {0.2, 4.0});
    std::vector<VectorX> start = straight_line(scene.model, scene.q, *problem.goal_q, kSteps);
    Term limits = term_of(scene.model, Quantity::kEffortLimits, false);
    limits.weight *= kExcess;
    Term effort = term_of(scene.model, Quantity::kAppliedForce, false);
    Result result;
    for (const double weight : {1.0, 0.3, 0.1, 0.03, 0.01}) {
      effort.weight.setConstant(weight / kForce);
      problem.terms = {term_of(scene.model, Quantity::kDuration, false), limits, effort};
      // The forward step cuts forces to the limit, h^2 / m times the excess, at most 3e-3 N.
      result = solve(problem, start, 1e-6, 3e-3 * std::pow(0.1, 2) / kMass);
      start = result.q;
      problem.options.time_step = result.options.time_step;
    }
    // With the cost T^2 / 2, a force e beyond the limit in all N steps saves T |dT/dF| e and costs
    // N kExcess^2 e^2 / 2: e = 8e-4 N, which shortens T by e / 16 = 5e-5. The effort, at most
    // N 0.01^2 / 2, lengthens it less.
    EXPECT_NEAR(duration_of(result), shortest, 2e-4) << guess;
    for (int t = 0; t < kSteps; ++t)
      EXPECT_NEAR(result.applied_force[static_cast<std::size_t>(t)][0],
                  t < kSteps / 2 ? kForce : -kForce, 3e-3)  // the largest of all e
          << t;
  }
}

TEST(Duration, StaysWithinItsBounds) {
  const Scene scene = test::slider({.mass = 2.0, .effort_limit = 8.0});
  for (const auto& [least, most] : {std::pair(1.3, 2.0), std::pair(3.0, 5.0)}) {
    Problem problem = block_of(scene, 0.5, {least, most});
    problem.terms = {term_of(scene.model, Quantity::kDuration, false),
                     term_of(scene.model, Quantity::kEffortLimits, false)};
    const Result quick =
        solve(problem, straight_line(scene.model, scene.q, *problem.goal_q, kSteps), 1e-6);
    EXPECT_NEAR(duration_of(quick), least, 1e-12 * least);  // round-off of N h
    problem.terms[0].target = VectorX::Constant(1, 10.0);
    const Result slow =
        solve(problem, straight_line(scene.model, scene.q, *problem.goal_q, kSteps), 1e-6);
    EXPECT_NEAR(duration_of(slow), most, 1e-12 * most);
  }
}

// A pendulum that swings by itself: with x_{t+1} - 2 x_t + x_{t-1} = -(w h)^2 x_t the angle turns
// on by 2 asin(w h / 2) a step, so that N steps are a period if h = 2 sin(pi / N) / w.
TEST(Duration, OfAFreePendulumIsItsPeriod) {
  constexpr double kAngle = 1e-3;
  const Scene scene = test::pendulum({.length = 0.7});
  const double rate = std::sqrt(9.81 / 0.7);
  const double period = 2.0 * kSteps * std::sin(std::numbers::pi / kSteps) / rate;
  for (const double guess : {0.8, 1.3}) {
    Problem problem = problem_of(scene, kSteps, guess * period, {0.6 * period, 1.6 * period});
    problem.periodic = true;
    problem.motors = {0};
    Term swings = term_of(scene.model, Quantity::kConfiguration, true, {0, 0});
    swings.target = VectorX::Constant(1, kAngle);
    Term unactuated = term_of(scene.model, Quantity::kUnactuatedForce, true);
    problem.terms = {swings, unactuated};
    std::vector<VectorX> start;
    for (int t = 0; t <= kSteps; ++t)
      start.push_back(VectorX::Constant(1, kAngle * std::cos(2.0 * std::numbers::pi * t / kSteps)));
    const Result result = solve(problem, start, 1e-12);
    // The amplitude adds kAngle^2 / 16, 6e-8; the force, 1e-2 N m, vanishes within 1e-12.
    EXPECT_NEAR(duration_of(result) / period, 1.0, 1e-6) << guess;
  }
}

TEST(Duration, IsNothingForAPlanner) {
  const Scene scene = test::slider({});
  Problem problem = problem_of(scene, 10, 1.0, {0.5, 2.0});
  EXPECT_THROW(Planner(problem, PlannerSettings()), InputError);
  problem.duration = {2.0, 0.5};
  EXPECT_THROW(check_problem(problem), InputError);
  problem.duration.reset();
  check_problem(problem);
  problem.terms = {term_of(scene.model, Quantity::kDuration, false)};
  EXPECT_THROW(check_problem(problem), InputError);  // it is fixed
}

}  // namespace
}  // namespace counterpoint::optimization::duration_test
