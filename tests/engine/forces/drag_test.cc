// Drag against its discrete scheme: free flight, spin, terminal velocity.
#include "counterpoint/engine/forces/drag.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::drag_test {
namespace {

constexpr double kRoundoff = 1e-12;

TEST(Drag, FreeFlightFollowsTheRecurrence) {
  const Drag drag{0.3, 0.7, 0.02, 0.05};
  const double mass = 2.0, moment = 0.4 * mass * 0.01;
  Scene scene = test::free_ball({.mass = mass, .gravity = {0, 0, 0}, .drag = drag});
  scene.v << 3.0, -4.0, 1.0, 5.0, 2.0, -6.0;
  Simulator sim(std::move(scene));
  const double h = sim.options().time_step;
  Vector3 v = sim.state().v.head<3>(), omega = sim.state().v.tail<3>();
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    v *= mass / (mass + h * (drag.linear + drag.quadratic * v.norm()));
    omega *= moment / (moment + h * (drag.angular + drag.angular_quadratic * omega.norm()));
    ASSERT_LT((sim.state().v.head<3>() - v).norm(), kRoundoff) << i;
    ASSERT_LT((sim.state().v.tail<3>() - omega).norm(), kRoundoff) << i;
  }
}

TEST(Drag, FallsAtTerminalVelocity) {
  for (const double linear : {0.0, 0.5}) {
    const double mass = 1.5, g = 9.81, quadratic = 0.4;
    Scene scene =
        test::free_ball({.mass = mass, .gravity = {0, 0, -g}, .drag = {linear, quadratic, 0, 0}});
    scene.options.time_step = 0.01;
    Simulator sim(std::move(scene));
    for (int i = 0; i < 3000; ++i) ASSERT_TRUE(sim.step().succeeded());
    // m g = (c1 + c2 v) v holds for the scheme as for the continuous motion.
    const double v =
        (-linear + std::sqrt(linear * linear + 4.0 * quadratic * mass * g)) / (2.0 * quadratic);
    EXPECT_NEAR(sim.state().v[2], -v, kRoundoff);
  }
}

TEST(Drag, PendulumIsTheSchemeByHandAtAnyCoefficient) {
  const double m = 1.3, l = 0.7, h = 0.01;
  for (const double scale : {1.0, 1e6}) {
    const Drag drag{0.4 * scale, 0.9 * scale, 0.05 * scale, 0.08 * scale};
    Scene scene = test::pendulum({.mass = m, .length = l, .drag = drag});
    scene.options.time_step = h;
    scene.q[0] = 0.9;
    scene.v[0] = -3.0;
    Simulator sim(std::move(scene));
    double q = 0.9, w = -3.0;
    for (int i = 0; i < 300; ++i) {
      const double c = (drag.linear + drag.quadratic * l * std::abs(w)) * l * l + drag.angular +
                       drag.angular_quadratic * std::abs(w);
      const double strength = c * std::abs(w);
      w = (m * l * l * w - h * m * 9.81 * l * std::sin(q)) / (m * l * l + h * c);
      q += h * w;
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
      ASSERT_NEAR(sim.state().v[0], w, kRoundoff) << scale << " step " << i;
      ASSERT_NEAR(sim.state().q[0], q, kRoundoff) << scale << " step " << i;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      // Rounding of the forces that cancel: the weight, and drag at the velocity before the step.
      ASSERT_LT(std::abs(inverse.applied_force[0]), 1e-11 * (m * 9.81 * l + strength)) << scale;
    }
  }
}

TEST(Drag, NeverAddsEnergyWithoutGravityAndSpin) {
  // Prismatic joints only: the explicit treatment of velocity-dependent forces could add energy.
  test::RandomModelOptions options;
  options.drag = true;
  for (int seed = 0; seed < 10; ++seed) {
    RobotSpec robot = test::make_random_robot(seed, options);
    for (JointSpec& joint : robot.joints) joint.type = JointType::kPrismatic;
    ModelBuilder builder(Vector3::Zero());
    builder.add_robot(robot, Base::kFixed, Pose());
    Model model = builder.build();
    if (model.nv() == 0) continue;
    Scene scene{"slides", model, model.default_q(), test::random_vector(model.nv(), seed), {}};
    Simulator sim(std::move(scene));
    Data data(model);
    const auto energy = [&] {
      compute_poses(model, sim.state().q, data);
      compute_velocities(model, sim.state().v, data);
      compute_inertias(model, data);
      return kinetic_energy(model, sim.state().v, data);
    };
    double last = energy();
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      const double now = energy();
      ASSERT_LT(now, last) << seed << " step " << i;
      last = now;
    }
  }
}

TEST(Drag, SwitchedOffOrAbsentItIsNotThere) {
  Scene scene = test::free_ball({.drag = {1, 1, 1, 1}});
  scene.options.effects.set(Effect::kDrag, false);
  scene.v[0] = 1.0;
  Simulator sim(std::move(scene));
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_EQ(sim.state().v[0], 1.0);
  EXPECT_EQ(sim.effect_counts()[Effect::kDrag], 0);
}

}  // namespace
}  // namespace counterpoint::drag_test
