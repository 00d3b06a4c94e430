// No number of bounces gains energy, for any integrator, step and shape.
#include "counterpoint/engine/constraints/bounce.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "counterpoint/engine/simulator.h"
#include "support/random_poses.h"
#include "support/small_scenes.h"

namespace counterpoint::bounce_test {
namespace {

constexpr double kGravity = 9.81;

/// T + U [J] of all free bodies at the time of the velocity: with semi_implicit_euler half a step
/// before that of the poses.
double energy(const Simulator& sim) {
  const Model& model = sim.model();
  const SimulationOptions& options = sim.options();
  const double late =
      options.integrator == Integrator::kSemiImplicitEuler ? 0.5 * options.time_step : 0.0;
  double sum = 0.0;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const Vector3 v = sim.state().v.segment<3>(body.v_index);
    const Vector3 w = sim.state().v.segment<3>(body.v_index + 3);
    const Vector3 p = Vector3(sim.state().q.segment<3>(body.q_index)) - late * v;
    sum += 0.5 * body.inertia.mass * v.squaredNorm() + 0.5 * w.dot(body.inertia.rotational * w) -
           body.inertia.mass * model.gravity().dot(p);
  }
  return sum;
}

/// Returns the largest relative gain of energy over the run. Checks the inverse of every step:
/// nothing is applied, so nothing may be found.
double largest_gain(Simulator& sim, double duration) {
  const double start = energy(sim);
  double most = start;
  for (int k = 0; k < std::lround(duration / sim.options().time_step); ++k) {
    const State before = sim.state();
    EXPECT_TRUE(sim.step().succeeded());
    most = std::max(most, energy(sim));
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
    // Rounding of the speed of rotating bodies over the compliance: concepts.md, accuracy of the
    // inverse.
    EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(),
              2e-7 * std::max(inverse.force_scale, kGravity));
  }
  return (most - start) / start;
}

struct Case {
  const char* name;
  Vector3 half;
  double friction, lean;  ///< slope of the ground [rad]
  bool flat;
};

constexpr Integrator kBoth[] = {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint};

class Bounces : public testing::TestWithParam<std::tuple<Integrator, double>> {};
INSTANTIATE_TEST_SUITE_P(All, Bounces,
                         testing::Combine(testing::ValuesIn(kBoth),
                                          testing::Values(0.0005, 0.002, 0.01)));

// Flat on four corners, from many heights: the same height again, up to the effect of the smoothing
// length (1e-13 m) and the compliance (1e-6 of the velocity an impact).
constexpr double kNoGain = 1e-9;
// The overlap correction of semi_implicit_euler lifts a corner that turned into the ground within
// 10 ms: 0.1 % of the energy in 3 s where friction dissipates none.
constexpr double kLifted = 2e-3;

TEST_P(Bounces, OfBoxesAndBallsGainNothing) {
  const auto [integrator, h] = GetParam();
  const Vector3 cube(0.1, 0.1, 0.1), brick(0.1, 0.06, 0.03), plate(0.2, 0.2, 0.01);
  const Case cases[] = {
      {"flat cube", cube, 0.8, 0.0, true},      {"cube", cube, 0.8, 0.0, false},
      {"smooth cube", cube, 0.0, 0.3, false},   {"brick", brick, 0.8, 0.0, false},
      {"smooth brick", brick, 0.0, 0.0, false}, {"brick on a slope", brick, 0.3, 0.3, false},
      {"plate", plate, 0.5, 0.0, false}};
  std::mt19937 random(11);
  for (const Case& c : cases) {
    for (int trial = 0; trial < 4; ++trial) {
      Scene scene = test::box_on_plane(
          {.half = c.half,
           .friction = c.friction,
           .restitution = 1.0,
           .gravity = kGravity * Vector3(std::sin(c.lean), 0, -std::cos(c.lean))});
      scene.options.integrator = integrator;
      scene.options.time_step = h;
      scene.q[2] = c.half[2] + std::uniform_real_distribution<>(0.02, 1.0)(random);
      if (!c.flat) {
        const Quaternion turn(test::random_rotation(random));
        scene.q.segment<4>(3) << turn.w(), turn.vec();
        scene.q[2] += c.half.norm();
        scene.v << test::random_vector(random, 0.5), test::random_vector(random, 2.0);
      }
      Simulator sim(std::move(scene));
      const bool lifts =
          h > 0.005 && integrator == Integrator::kSemiImplicitEuler && c.friction == 0.0;
      EXPECT_LT(largest_gain(sim, h < 0.001 ? 0.7 : 2.0), lifts ? kLifted : kNoGain)
          << c.name << ' ' << trial;
    }
  }
}

TEST_P(Bounces, OfABallComeToTheSameHeight) {
  const auto [integrator, h] = GetParam();
  for (const double height : {0.013, 0.1, 0.37, 1.0, 2.9}) {
    Scene scene = test::ball_on_plane({.height = height, .material = {.restitution = 1.0}});
    scene.options.integrator = integrator;
    scene.options.time_step = h;
    Simulator sim(std::move(scene));
    const double start = energy(sim);
    EXPECT_LT(largest_gain(sim, 3.0), kNoGain) << height;
    // The compliance of each bounce; there are ten to thirty.
    EXPECT_NEAR(energy(sim), start, 1e-3 * start) << height;
  }
}

}  // namespace
}  // namespace counterpoint::bounce_test
