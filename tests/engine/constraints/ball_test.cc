// A ball on a plane: from sliding to rolling, rolling and torsional friction, bouncing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model_builder.h"
#include "support/small_scenes.h"

namespace counterpoint::ball_test {
namespace {

constexpr double kGravity = 9.81, kRadius = 0.1, kMass = 2.0;

Simulator ball(const Material& material, FrictionModel model, double height = 0.0) {
  Scene scene = test::ball_on_plane(
      {.radius = kRadius, .mass = kMass, .height = height, .material = material});
  scene.options.contact.friction_model = model;
  return Simulator(std::move(scene));
}

void start(Simulator& sim, const Vector3& linear, const Vector3& angular) {
  State state = sim.state();
  state.v << linear, angular;
  sim.set_state(state);
}

/// Checks the inverse of every step: nothing is applied, so nothing may be found.
void run(Simulator& sim, double duration) {
  const int steps = static_cast<int>(std::lround(duration / sim.options().time_step));
  for (int i = 0; i < steps; ++i) {
    const VectorX q = sim.state().q, v = sim.state().v;
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded()) << "step " << i << contact::status_name(report.status);
    const Inverse& inverse = sim.inverse(q, v, sim.state().v);
    // Rounding of r w (radius times spin) in the normal velocity, over mu^2 r h: 1.1e-16 |v| /
    // (mu^2 eps g h) of the weight, 1.3e-7 at 2 m/s and mu 0.3.
    ASSERT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1.3e-7 * inverse.force_scale) << i;
  }
}

Vector3 world_spin(const Simulator& sim) {
  const VectorX& q = sim.state().q;
  return Quaternion(q[3], q[4], q[5], q[6]).toRotationMatrix() * Vector3(sim.state().v.tail<3>());
}

TEST(Ball, SlidesUntilItRolls) {
  // v falls at mu g, r w grows at 5/2 of that: they meet at 5/7 v0 after 2 v0 / (7 mu g).
  const double v0 = 2.0, mu = 0.3, meets = 2.0 * v0 / (7.0 * mu * kGravity);
  for (const double heading : {0.0, 0.7, 2.5}) {
    Simulator sim = ball({.friction = mu}, FrictionModel::kCoulomb);
    const double h = sim.options().time_step;
    const Vector3 ahead(std::cos(heading), std::sin(heading), 0);
    start(sim, v0 * ahead, Vector3::Zero());
    run(sim, meets - 2.0 * h);
    EXPECT_GT(ahead.dot(sim.state().v.head<3>()), 5.0 / 7.0 * v0);
    run(sim, 0.5);
    const Vector3 v = sim.state().v.head<3>(), w = world_spin(sim);
    // The solver's 1e-10 per impulse, and creep.
    EXPECT_LT((v - 5.0 / 7.0 * v0 * ahead).norm(), 1e-7);
    EXPECT_LT((kRadius * w - Vector3::UnitZ().cross(v)).norm(), 1e-7);
  }
}

TEST(Ball, RollingFrictionSlowsIt) {
  // The torque t m g opposes rolling: (m + I / r^2) a = -t m g / r.
  const double t = 0.002, v0 = 0.5, a = 5.0 / 7.0 * kGravity * t / kRadius;
  Simulator sim = ball({.friction = 0.8, .rolling_friction = t}, FrictionModel::kCoulomb);
  start(sim, Vector3(v0, 0, 0), Vector3(0, v0 / kRadius, 0));
  run(sim, 1.0);
  // One cone holds sliding and rolling, f_i = -mu_i^2 b v_i: the force m a comes with a slip of (t
  // / mu)^2 (m a / (t m g)) w, 2e-4 m/s here, and v differs by 2/7 of it.
  EXPECT_NEAR(sim.state().v[0], v0 - a, 1e-4);
  run(sim, v0 / a);
  EXPECT_LT(sim.state().v.norm(), 1e-7);
}

TEST(Ball, TorsionalFrictionStopsItsSpin) {
  // I dw/dt = -t m g.
  const double t = 0.001, w0 = 4.0, deceleration = t * kGravity / (0.4 * kRadius * kRadius);
  for (const FrictionModel model : {FrictionModel::kCoulomb, FrictionModel::kConvex}) {
    Simulator sim = ball({.friction = 0.8, .torsional_friction = t}, model);
    start(sim, Vector3::Zero(), Vector3(0, 0, w0));
    run(sim, 1.0);
    // The convex law hovers at h t w. As w falls the ball sinks, and the ground gives h t dw/dt
    // less impulse per mass.
    const double hover = sim.options().time_step * t * deceleration * t / (0.4 * kRadius * kRadius);
    EXPECT_NEAR(sim.state().v[5], w0 - deceleration,
                model == FrictionModel::kConvex ? 1.1 * hover : 1e-7);
    run(sim, w0 / deceleration);
    EXPECT_LT(sim.state().v.norm(), 1e-7);
  }
}

TEST(Ball, FrictionOfOneSurfaceActsWhateverTheOtherHas) {
  // Rolling slows as in RollingFrictionSlowsIt and the torque t m g stops a spin, with the friction
  // on either surface.
  const double t = 0.002, v0 = 0.5, slows = 5.0 / 7.0 * kGravity * t / kRadius;
  const double brakes = t * kGravity / (0.4 * kRadius * kRadius);
  for (const bool of_ball : {true, false}) {
    for (const bool rolls : {true, false}) {
      Scene scene = test::ball_on_plane({.radius = kRadius, .mass = kMass});
      ModelEditor editor(scene.model);
      for (int g = 0; g < 2; ++g) {
        Material m = scene.model.geometries()[static_cast<size_t>(g)].material;
        if ((scene.model.geometries()[static_cast<size_t>(g)].body != 0) == of_ball)
          (rolls ? m.rolling_friction : m.torsional_friction) = t;
        editor.set_material(g, m);
      }
      scene.model = editor.take();
      Simulator sim(std::move(scene));
      rolls ? start(sim, Vector3(v0, 0, 0), Vector3(0, v0 / kRadius, 0))
            : start(sim, Vector3::Zero(), Vector3(0, 0, 10.0));
      run(sim, 1.0);
      // Slip of the common cone, as above.
      const double left = rolls ? v0 - slows : 10.0 - brakes, error = rolls ? 1e-4 : 1e-7;
      EXPECT_NEAR(sim.state().v[rolls ? 0 : 5], left, error);
    }
  }
}

TEST(Ball, BouncesAndComesToRestInTheTimeItShould) {
  // Heights are e^2n H; rest after sqrt(2 H / g) (1 + e) / (1 - e).
  const double height = 1.0, h = 0.0005;
  for (const double e : {0.3, 0.5, 0.7}) {
    Simulator sim = ball({.friction = 0.5, .restitution = e}, FrictionModel::kCoulomb, height);
    sim.options().time_step = h;
    const double expected = std::sqrt(2.0 * height / kGravity) * (1.0 + e) / (1.0 - e);
    std::vector<double> peaks;
    double last_speed = 0.0, moving_until = 0.0;
    for (int i = 0; i < static_cast<int>(2.0 * expected / h); ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      const double speed = sim.state().v[2];
      if (last_speed > 0.0 && speed <= 0.0) peaks.push_back(sim.state().q[2] - kRadius);
      if (std::abs(speed) > 0.01) moving_until = sim.state().time;
      last_speed = speed;
    }
    // A bounce may be one step early or late, and starts up to v h above the plane.
    const double bounces = std::log(0.01 / std::sqrt(2.0 * kGravity * height)) / std::log(e);
    EXPECT_NEAR(moving_until, expected, 2.0 * h * bounces) << e;
    const double travel = h * std::sqrt(2.0 * kGravity * height);
    ASSERT_GE(peaks.size(), 2u);
    EXPECT_NEAR(peaks[0], e * e * height, travel) << e;
    EXPECT_NEAR(peaks[1], e * e * e * e * height, travel) << e;
  }
}

}  // namespace
}  // namespace counterpoint::ball_test
