// Only external forces change the linear momentum of floating trees, whatever acts within them.
#include "counterpoint/engine/forces/free_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "counterpoint/engine/dynamics/energy.h"
#include "support/linkages.h"
#include "support/random_model.h"
#include "support/step_derivatives.h"

namespace counterpoint::free_groups_test {
namespace {

struct Way {
  Integrator integrator = Integrator::kSemiImplicitEuler;
  bool mean = true;
  std::string name;
};

class Momentum : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Ways, Momentum,
                         ::testing::Values(Way{Integrator::kSemiImplicitEuler, true, "euler"},
                                           Way{Integrator::kSemiImplicitEuler, false,
                                               "euler_start"},
                                           Way{Integrator::kImplicitMidpoint, true, "midpoint"},
                                           Way{Integrator::kRungeKutta4, true, "runge_kutta"}),
                         [](const auto& way) { return way.param.name; });

Simulator simulate(Model model, const Way& way) {
  Simulator sim = test::simulate(std::move(model));
  sim.options().integrator = way.integrator;
  sim.options().mean_velocity_forces = way.mean;
  return sim;
}

struct Center {
  double mass = 0.0;
  Vector3 position = Vector3::Zero(), momentum = Vector3::Zero();
};

Center center_of(const Simulator& sim) {
  const Data data = test::kinematics_of(sim);
  Center center;
  center.momentum = total_momentum(sim.model(), data).force;
  for (int i = 1; i < sim.model().num_bodies(); ++i) {
    const SpatialInertia& inertia = sim.model().body(i).inertia;
    center.mass += inertia.mass;
    center.position += inertia.mass * (data.X_WB[i] * inertia.center);
  }
  center.position /= center.mass;
  return center;
}

/// A tree of six links with forces that act within it; some integrators refuse some of these.
Model inner_forces(int seed, Integrator integrator, int robots) {
  const bool euler = integrator == Integrator::kSemiImplicitEuler;
  const bool rows = integrator != Integrator::kRungeKutta4;
  test::RandomModelOptions options{.links = 6, .robots = robots};
  options.damping = options.armature = options.springs = seed % 2 == 0;
  options.servos = seed % 3 == 0 && rows;  // too stiff for an explicit method
  options.effort_limits = options.servos && euler;
  options.dry_friction = seed % 4 == 1 && rows;
  options.mimics = seed % 5 == 2 && rows;
  return test::make_random_model(static_cast<std::uint64_t>(seed), options);
}

/// Internal impulses [N s] must not change the momentum; gravity alone does.
TEST_P(Momentum, OfLinkagesIsThatOfOuterForcesToRounding) {
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Model model = inner_forces(seed, GetParam().integrator, 1);
    const int joints = model.nv() - 6;
    if (joints <= 0) continue;
    Simulator sim = simulate(std::move(model), GetParam());
    const double h = sim.options().time_step;
    const Vector3 gravity = sim.model().gravity();
    const Center before = center_of(sim);
    double impulse = 0.0;
    Vector3 fallen = Vector3::Zero();
    for (int i = 1; i <= 200; ++i) {
      const VectorX torque = test::random_vector(joints, static_cast<std::uint64_t>(i), 1.0);
      sim.input().applied_force = VectorX::Zero(sim.model().nv());
      sim.input().applied_force.tail(joints) = torque;
      impulse += h * torque.lpNorm<1>();
      const Vector3 start = center_of(sim).momentum / before.mass;
      ASSERT_TRUE(sim.step().succeeded()) << i;
      const Center now = center_of(sim);
      const Vector3 weight = before.mass * gravity * (h * i);
      ASSERT_LE((now.momentum - before.momentum - weight).norm(), 1e-12 * (impulse + weight.norm()))
          << i;
      if (!GetParam().mean) continue;
      // The centre of mass follows the momentum, up to rounding of coordinates of some metres.
      const Vector3 end = now.momentum / before.mass;
      const bool euler = GetParam().integrator == Integrator::kSemiImplicitEuler;
      fallen += h * (euler ? end : Vector3(0.5 * (start + end)));
      ASSERT_LE((now.position - before.position - fallen).norm(), 1e-12) << i;
    }
  }
}

Model two_tied_robots(int seed) {
  const RobotSpec robot = test::make_random_robot(static_cast<std::uint64_t>(seed), {.links = 4});
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFloating, Pose(), "a/");
  builder.add_robot(robot, Base::kFloating, Pose(), "b/");
  ClosureSpec ball;
  ball.type = ClosureType::kBall;
  ball.link_a = "a/" + robot.links.back().name;
  ball.link_b = "b/" + robot.links.back().name;
  builder.add_closure(ball);
  return builder.build();
}

TEST_P(Momentum, OfTreesThatClosuresJoinIsKept) {
  if (GetParam().integrator == Integrator::kRungeKutta4) GTEST_SKIP() << "closures of equal bodies";
  for (int seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Simulator sim = simulate(two_tied_robots(seed), GetParam());
    double impulse = 0.0;
    for (int i = 1; i <= 200; ++i) {
      VectorX u = test::random_vector(sim.model().nv(), static_cast<std::uint64_t>(i), 2.0);
      for (const Tree& tree : sim.model().trees()) u.segment<6>(tree.v_begin).setZero();
      sim.input().applied_force = u;
      impulse += sim.options().time_step * u.lpNorm<1>();
      ASSERT_TRUE(sim.step().succeeded()) << i;
      ASSERT_LE(center_of(sim).momentum.norm(), 1e-12 * std::max(impulse, 1.0)) << i;
    }
    EXPECT_LT(test::open_by(sim), 1e-4);
  }
}

// A body whose frame origin is off its centre of mass, under random forces and torques.
TEST_P(Momentum, OfABodyOffItsCenterIsThatOfItsWrenches) {
  RobotSpec robot = test::base_only("body", "link");
  robot.links[0].inertia = {2.0, Vector3(0.3, -0.2, 0.1), Vector3(0.1, 0.2, 0.25).asDiagonal()};
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFloating, Pose());
  Simulator sim = simulate(builder.build(), GetParam());
  Vector3 impulse = Vector3::Zero();
  for (int i = 1; i <= 500; ++i) {
    ExternalWrench wrench;
    wrench.body = 1;
    wrench.wrench.torque = test::random_vector(3, static_cast<std::uint64_t>(i), 4.0);
    wrench.wrench.force = test::random_vector(3, static_cast<std::uint64_t>(i + 1000), 1.0);
    sim.input().wrenches = {wrench};
    impulse += sim.options().time_step * wrench.wrench.force;
    ASSERT_TRUE(sim.step().succeeded()) << i;
    ASSERT_LE((center_of(sim).momentum - impulse).norm(), 1e-12) << i;
  }
}

/// Angular momentum about the centre of mass [N m s], after two seconds, of a base of 10 kg with an
/// arm of two rods whose joint torques are sines of time.
double angular_momentum(const Way& way, double h) {
  RobotSpec robot = test::base_only("robot", "base");
  robot.links[0].inertia = {10.0, Vector3::Zero(), Vector3(0.5, 0.6, 0.7).asDiagonal()};
  const Vector3 down = -0.8 * Vector3::UnitZ();
  test::add_rod(robot, "a", "base", "j1", Vector3(0.2, 0, -0.1), down, Vector3::UnitY());
  test::add_rod(robot, "b", "a", "j2", down, down, Vector3::UnitX());
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFloating, Pose());
  Simulator sim = simulate(builder.build(), way);
  sim.options().time_step = h;
  const int steps = static_cast<int>(std::lround(2.0 / h));
  for (int i = 0; i < steps; ++i) {
    const double t = h * (i + 0.5);
    sim.input().applied_force.tail<2>() << std::sin(2.0 * t), std::sin(1.6 * t);
    EXPECT_TRUE(sim.step().succeeded());
  }
  const Center center = center_of(sim);
  const Force total = total_momentum(sim.model(), test::kinematics_of(sim));
  return (total.torque - center.position.cross(center.momentum)).norm();
}

TEST_P(Momentum, AngularIsKeptToTheOrderOfTheIntegrator) {
  // The rods turn within tenths of a second; at shorter steps RK4 would reach rounding.
  const bool euler = GetParam().integrator == Integrator::kSemiImplicitEuler;
  const double h = euler ? 0.002 : 0.01;
  const double order = euler                                                    ? 1.0
                       : GetParam().integrator == Integrator::kImplicitMidpoint ? 2.0
                                                                                : 4.0;
  const double coarse = angular_momentum(GetParam(), h);
  const double fine = angular_momentum(GetParam(), 0.5 * h);
  EXPECT_NEAR(std::log2(coarse / fine), order, 0.25);
  // 2 % of the impulse of torques of about 1 N m over two seconds.
  EXPECT_LT(coarse, 0.05);
}

TEST_P(Momentum, TheInverseFindsWhatWasApplied) {
  if (GetParam().integrator == Integrator::kRungeKutta4) GTEST_SKIP() << "it has no inverse";
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Simulator sim = simulate(inner_forces(seed, GetParam().integrator, 1 + seed % 2), GetParam());
    const int nv = sim.model().nv();
    for (int i = 1; i <= 50; ++i) {
      // Forces on the bases, too.
      sim.input().applied_force = test::random_vector(nv, static_cast<std::uint64_t>(i), 3.0);
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded()) << i;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
      if (!sim.model().servos().empty() || !sim.model().dry_friction().isZero(0.0)) continue;
      const double error =
          (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff();
      ASSERT_LE(error, 1e-9 * std::max(inverse.force_scale, 1.0)) << i;
    }
  }
}

TEST_P(Momentum, DerivativesAreThoseOfTheStep) {
  if (GetParam().integrator == Integrator::kRungeKutta4) GTEST_SKIP() << "it has no inverse";
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene{"tree",
                test::make_random_model(static_cast<std::uint64_t>(seed), {.links = 5}),
                {},
                {},
                {}};
    scene.q = test::random_configuration(scene.model, 7);
    scene.v = test::random_vector(scene.model.nv(), 8, 1.0);
    scene.options.integrator = GetParam().integrator;
    scene.options.mean_velocity_forces = GetParam().mean;
    test::Moment moment{
        scene.q, scene.v, scene.v + 0.01 * test::random_vector(scene.model.nv(), 9, 1.0), {}, {}};
    test::expect_exact(scene, moment, GetParam().name);
  }
}

// A correction must not move a tree that touches the ground: a sticking foot would creep.
TEST(FreeGroups, HoldNothingThatTouchesTheWorld) {
  RobotSpec robot = test::base_only("robot", "base");
  robot.links[0].inertia = {1.0, Vector3::Zero(), 0.1 * Matrix3::Identity()};
  test::add_rod(robot, "arm", "base", "joint", Vector3::Zero(), Vector3(0, 0, 1.0),
                Vector3::UnitY());
  for (const bool held : {false, true}) {
    ModelBuilder builder(Vector3::Zero());
    builder.add_robot(robot, Base::kFloating, Pose());
    if (held) {
      ClosureSpec ball;
      ball.type = ClosureType::kBall;
      ball.link_a = "base";
      ball.link_b = "world";
      builder.add_closure(ball);
    }
    const Model model = builder.build();
    Data data(model);
    const VectorX v = VectorX::Zero(model.nv());
    compute_poses(model, model.default_q(), data);
    compute_velocities(model, v, data);
    FreeGroups groups(model);
    const VectorX q = model.default_q();
    const SimulationOptions options;
    groups.find({model, options, EffectSet::all(), q, v}, {}, {}, data);
    EXPECT_EQ(groups.groups().size(), held ? 0u : 1u);
  }
}

}  // namespace
}  // namespace counterpoint::free_groups_test
