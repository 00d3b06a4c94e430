// Step control: the error follows the tolerance, steps land on impacts, failures are reported.
#include "support/step_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/allocation_guard.h"
#include "support/linkages.h"
#include "support/small_scenes.h"

namespace counterpoint::step_control_test {
namespace {

// Depth [m] of a ball at rest: eps g h^2 / beta, with compliance eps, h half of max_step, and
// stabilization beta.
constexpr double kSink = 1e-6 * 9.81 * 0.05 * 0.05 / 0.2;

using test::controlled;
using test::run_until;
using test::Steps;

/// Step control promises an error in proportion to the tolerance. Double pendulum over 1 s, against
/// Runge-Kutta steps of 50 us, whose own error is below 1e-12 (at 100 us it is 2^4 times larger,
/// and the two differ by less than 1e-12: the first assertion).
TEST(StepControl, TheErrorFollowsTheTolerance) {
  const auto fixed = [](double h) {
    Scene scene = test::double_pendulum();
    scene.options.integrator = Integrator::kRungeKutta4;
    scene.options.time_step = h;
    Simulator sim(std::move(scene));
    const long steps = std::lround(1.0 / h);
    for (long k = 0; k < steps; ++k) EXPECT_TRUE(sim.step().succeeded());
    return sim.state();
  };
  const State exact = fixed(5e-5);
  ASSERT_LT((fixed(1e-4).q - exact.q).norm(), 1e-12);
  struct Range {
    Integrator integrator;
    double coarse, fine;
  };
  for (const auto& [integrator, coarse, fine] : {Range{Integrator::kSemiImplicitEuler, 1e-1, 1e-3},
                                                 Range{Integrator::kImplicitMidpoint, 1e-2, 1e-5},
                                                 Range{Integrator::kRungeKutta4, 1e-3, 1e-9}}) {
    double first = 0.0;
    for (double tolerance = coarse; tolerance > 0.5 * fine; tolerance *= 0.1) {
      Simulator sim = controlled(test::double_pendulum(), integrator, tolerance);
      const Steps run = run_until(sim, 1.0);
      EXPECT_EQ(sim.state().time, 1.0);
      EXPECT_EQ(run.missed, 0);
      const double share = (sim.state().q - exact.q).norm() / tolerance;
      // Errors of each second propagate with the motion: two coordinates, a few times.
      EXPECT_LT(share, 10.0) << integrator_name(integrator) << " " << tolerance;
      if (first == 0.0) first = share;
      RecordProperty(integrator_name(integrator) + std::to_string(tolerance),
                     std::to_string(share));
      // In proportion: within a factor of five over all decades, six of them for order four.
      EXPECT_LT(share / first, 5.0) << integrator_name(integrator) << " " << tolerance;
      EXPECT_GT(share / first, 1.0 / 5.0) << integrator_name(integrator) << " " << tolerance;
    }
  }
}

/// A ball dropped from H with restitution e meets the ground after sqrt(2 H / g) and is at rest
/// after sqrt(2 H / g) (1 + e) / (1 - e).
TEST(StepControl, ABouncingBallLandsOnTime) {
  const double height = 1.0, e = 0.5, g = 9.81, tolerance = 1e-4;
  const double fall = std::sqrt(2.0 * height / g), total = fall * (1.0 + e) / (1.0 - e);
  for (const double event : {1e-3, 1e-5, 1e-7}) {
    Simulator sim = controlled(
        test::ball_on_plane({.height = height, .material = {.friction = 0.0, .restitution = e}}),
        Integrator::kImplicitMidpoint, tolerance);
    sim.options().step_control->event_tolerance = event;
    double landed = -1.0, last = 0.0;
    const Steps run =
        run_until(sim, 1.2 * total, [&](const ControlledReport& step, const State& before) {
          if (!step.impact) return;
          // The impact is in this step, which is no longer than requested.
          EXPECT_LE(step.step, event * (1.0 + 1e-12));
          if (landed < 0.0) {
            EXPECT_LE(before.time, fall);
            landed = sim.state().time;
          }
          last = sim.state().time;
        });
    EXPECT_EQ(run.missed, 0);
    // Free fall by the midpoint rule is exact, so the impact is inside the step that landed on it.
    EXPECT_NEAR(landed, fall, event) << event;
    // The last bounces, below ten tolerances [m/s] or shorter than ten event steps, count as rest:
    // the remaining time is the geometric series from there.
    const double tail = (2.0 * 10.0 * tolerance / g + 10.0 * event) / (1.0 - e);
    EXPECT_NEAR(last, total, tail) << event;
    EXPECT_NEAR(sim.state().q[2], 0.1, kSink) << event;
    EXPECT_LT(run.accepted, 2000) << "steps grow again between impacts";
  }
}

/// A ball that stops on impact: the fall is accurate to the tolerance, the landing is at the
/// ground, and after it nothing moves and steps have their maximum length.
TEST(StepControl, ABallThatStopsIsLandedOnByEveryIntegrator) {
  const double g = 9.81, fall = std::sqrt(2.0 / g), tolerance = 1e-2;
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    Simulator sim =
        controlled(test::ball_on_plane({.height = 1.0, .material = {}}), integrator, tolerance);
    double landed = -1.0;
    const Steps run = run_until(sim, 1.0, [&](const ControlledReport& step, const State&) {
      if (step.impact && landed < 0.0) landed = sim.state().time;
    });
    // The tolerance in position after the fall, over the speed of landing, and the event tolerance.
    EXPECT_NEAR(landed, fall, tolerance * fall / (g * fall) + 1e-6);
    EXPECT_NEAR(sim.state().q[2], 0.1, kSink) << integrator_name(integrator);
    EXPECT_GT(run.longest, 0.09) << "a ball at rest asks for no short steps";
    EXPECT_LE(run.impacts, 3) << integrator_name(integrator);
  }
}

/// A block with a strong damper: its speed falls as e^(-1000 t), after which nothing needs short
/// steps.
TEST(StepControl, AStiffPassageTakesSmallStepsAndLargeOnesAfter) {
  Scene scene = test::slider({.mass = 1.0, .damping = 1000.0});
  scene.v[0] = 1.0;
  Simulator sim = controlled(std::move(scene), Integrator::kImplicitMidpoint, 1e-4);
  double first = 0.0, after = 0.0;
  run_until(sim, 1.0, [&](const ControlledReport& step, const State& before) {
    double& longest = before.time < 1e-3 ? first : after;
    longest = std::max(longest, step.step);
  });
  EXPECT_LT(first, 2e-4) << "within the time constant of 1 ms";
  EXPECT_GT(after, 0.05) << "when the motion has died away";
  // The distance covered, v m / c = 1 mm, to the tolerance.
  EXPECT_NEAR(sim.state().q[0], 1e-3, 1e-4);
}

TEST(StepControl, TheInverseOfTheHalvesReturnsWhatWasApplied) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    Simulator sim = controlled(test::double_pendulum(), integrator, 1e-2);
    sim.input().applied_force = Eigen::Vector2d(1.5, -0.7);
    State before = sim.state();
    const SimulationOptions options = sim.options();
    run_until(sim, 0.5, [&](const ControlledReport& step, const State&) {
      // Each half is a step of known length.
      sim.options().time_step = 0.5 * step.step;
      for (const auto& [from, to] :
           {std::pair(before, sim.middle()), {sim.middle(), sim.state()}}) {
        const Inverse& inverse = sim.inverse(from.q, from.v, to.q, to.v);
        // Rounding of the velocities over the length of the step, for an inertia of about 1 kg m^2.
        const double rounding = 1e-14 / (0.5 * step.step);
        EXPECT_LT((inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff(),
                  1e-10 * inverse.force_scale + rounding);
      }
      sim.options() = options;
      before = sim.state();
    });
  }
}

TEST(StepControl, IsAFunctionOfTheStateAndTheNextStep) {
  const auto make = [] {
    Scene scene = test::box_on_plane({.restitution = 0.3, .height = 0.05});
    scene.v << 1.0, 0.2, 0.0, 1.0, 2.0, 0.5;
    Simulator sim = controlled(std::move(scene), Integrator::kSemiImplicitEuler, 1e-2);
    sim.options().step_control->interval = 0.1;
    return sim;
  };
  Simulator whole = make();
  run_until(whole, 0.4);
  Simulator first = make(), second = make();
  run_until(first, 0.2);
  second.set_state(first.state());
  second.set_next_step(first.next_step());
  run_until(second, 0.4);
  EXPECT_EQ(state_hash(second.state()), state_hash(whole.state()));
  EXPECT_EQ(second.next_step(), whole.next_step());
}

TEST(StepControl, WhatCannotBeMetIsCountedOrRefused) {
  for (const bool strict : {false, true}) {
    Simulator sim = controlled(test::double_pendulum(), Integrator::kSemiImplicitEuler, 1e-9);
    StepControlOptions& control = *sim.options().step_control;
    control.min_step = control.event_tolerance = 1e-4;
    control.strict = strict;
    const ControlledReport step = sim.step_controlled(1.0);
    EXPECT_EQ(step.succeeded(), !strict);
    EXPECT_TRUE(step.missed);
    EXPECT_GT(step.error, 1.0);
    EXPECT_EQ(step.step, 1e-4);
    if (!strict) continue;
    EXPECT_EQ(sim.state().time, 0.0) << "the state stays";
    EXPECT_EQ(step.second.status, contact::Status::kNoProgress);
    EXPECT_EQ(step.second.fault.kind, FaultKind::kTolerance);
    const FaultText text = describe(sim.model(), step.second.fault);
    EXPECT_NE(text.reason.find("times the tolerance"), std::string::npos) << text.reason;
    EXPECT_FALSE(text.element.empty());
  }
}

/// Where the midpoint rule is not solved the step is too long; it is retried shorter.
TEST(StepControl, AStepThatFailsIsTriedShorter) {
  Scene scene = test::double_pendulum();
  scene.v << 200.0, -300.0;
  scene.options.time_step = 0.05;  // ten radians
  Simulator fixed(scene);
  fixed.options().integrator = Integrator::kImplicitMidpoint;
  ASSERT_FALSE(fixed.step().succeeded()) << "or this test shows nothing";
  Simulator sim = controlled(std::move(scene), Integrator::kImplicitMidpoint, 1.0);
  const ControlledReport step = sim.step_controlled(1.0);
  EXPECT_TRUE(step.succeeded());
  EXPECT_GT(step.rejected, 0);
}

TEST(StepControl, RefusesWhatIsWrongAndSaysWhat) {
  Simulator sim(test::double_pendulum());
  EXPECT_THROW(sim.step_controlled(1.0), InputError) << "not asked for";
  sim.options().step_control.emplace();
  EXPECT_THROW(sim.step_controlled(0.0), InputError) << "no time left";
  sim.input().applied_force[1] = std::numeric_limits<double>::quiet_NaN();
  const ControlledReport step = sim.step_controlled(1.0);
  EXPECT_FALSE(step.succeeded());
  EXPECT_EQ(step.second.fault.kind, FaultKind::kAppliedForce);
  EXPECT_EQ(step.evaluations, 1) << "shorter steps would not mend it";
  Simulator box(test::box_on_plane({}));
  box.options().step_control.emplace();
  box.options().integrator = Integrator::kRungeKutta4;
  EXPECT_THROW(box.step_controlled(1.0), InputError) << "contacts";
}

TEST(StepControl, LandsOnTheMultiplesOfTheInterval) {
  StepControlOptions control;
  EXPECT_EQ(next_landing(control, 0.3, 2.0), 2.0);
  control.interval = 0.1;
  EXPECT_EQ(next_landing(control, 0.0, 2.0), 0.1);
  EXPECT_EQ(next_landing(control, 0.1, 2.0), 0.2);
  EXPECT_EQ(next_landing(control, 0.1 - 1e-12, 2.0), 0.2) << "rounding of the time";
  EXPECT_EQ(next_landing(control, 1.95, 1.96), 1.96);
}

TEST(StepControl, DoesNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  // It bounces, slides and comes to rest, then once more from the start.
  Scene scene = test::ball_on_plane({.height = 0.1, .material = {.restitution = 0.5}});
  Simulator sim = controlled(std::move(scene), Integrator::kSemiImplicitEuler, 1e-2);
  const State start = sim.state();
  run_until(sim, 1.0);
  sim.set_state(start);
  const std::size_t before = test::allocation_count();
  while (sim.state().time < 1.0) sim.step_controlled(1.0);
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

}  // namespace
}  // namespace counterpoint::step_control_test
