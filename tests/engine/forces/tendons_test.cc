// Forces of tendons against the discrete scheme by hand, and their inverse. Lengths and moment
// arms: tendon_lengths_test.cc.
#include "counterpoint/engine/forces/tendons.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/linkages.h"
#include "support/random_model.h"
#include "support/recover.h"
#include "support/small_scenes.h"

namespace counterpoint::tendons_test {
namespace {

using Place = TendonSpec::Place;
using Kind = Place::Kind;

constexpr double kRoundoff = 1e-12;

Place point(const std::string& link, const Vector3& at) {
  Place place;
  place.link = link;
  place.X_LG.translation = at;
  return place;
}

Place wrap(Kind kind, const std::string& link, const Vector3& at, double radius) {
  Place place = point(link, at);
  place.kind = kind;
  place.radius = radius;
  return place;
}

Place pulley(double divisor) {
  Place place;
  place.kind = Kind::kPulley;
  place.divisor = divisor;
  return place;
}

/// Blocks on vertical prismatic joints "slide0", "slide1" ... whose links are "block0" ..., each
/// placed at x = its index [m]; gravity along -z.
Scene blocks(const std::vector<double>& masses, const std::vector<TendonSpec>& tendons) {
  ModelBuilder builder;
  for (size_t i = 0; i < masses.size(); ++i) {
    RobotSpec robot;
    robot.name = "robot" + std::to_string(i);
    LinkSpec base, block;
    base.name = "base" + std::to_string(i);
    block.name = "block" + std::to_string(i);
    block.inertia.mass = masses[i];
    block.inertia.rotational = Matrix3::Identity();
    robot.links = {base, block};
    JointSpec joint;
    joint.name = "slide" + std::to_string(i);
    joint.type = JointType::kPrismatic;
    joint.parent = base.name;
    joint.child = block.name;
    joint.axis = Vector3::UnitZ();
    robot.joints = {joint};
    builder.add_robot(robot, Base::kFixed,
                      {Matrix3::Identity(), Vector3(static_cast<double>(i), 0, 0)});
  }
  for (const TendonSpec& tendon : tendons) builder.add_tendon(tendon);
  return scene_of(builder.build());
}

double length_at(const Model& model, int tendon, const VectorX& q) {
  return tendon_length(model, model.tendons()[static_cast<size_t>(tendon)], q,
                       body_poses(model, q));
}

/// Two blocks and a spring over the sum of their heights, c0 q0 + c1 q1: by hand
/// (M + c c' (h d + h^2 k)) w+ = M w - h (M g e + c k (L - L0)).
TEST(Tendons, SpringAndDamperOverTwoJointsAsByHand) {
  TendonSpec tendon;
  tendon.joints = {{"slide0", 0.5}, {"slide1", -0.3}};
  tendon.stiffness = 400.0;
  tendon.damping = 3.0;
  tendon.rest = std::pair(0.1, 0.1);
  Scene scene = blocks({2.0, 0.7}, {tendon});
  scene.options.mean_velocity_forces = false;
  const double h = scene.options.time_step;
  const Eigen::Vector2d c(0.5, -0.3), mass(2.0, 0.7);
  Eigen::Matrix2d A = mass.asDiagonal();
  A += c * c.transpose() * (h * tendon.damping + h * h * tendon.stiffness);
  Eigen::Vector2d q = Eigen::Vector2d::Zero(), w = q;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 300; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const double pull = tendon.stiffness * (c.dot(q) - 0.1);
    const Eigen::Vector2d b = mass.cwiseProduct(w) - h * (kStandardGravity * mass + c * pull);
    w = A.ldlt().solve(b);
    const double force = -pull - (tendon.damping + h * tendon.stiffness) * c.dot(w);
    q += h * w;
    ASSERT_LT((sim.state().v - w).norm(), kRoundoff) << i;
    ASSERT_LT((sim.state().q - q).norm(), kRoundoff) << i;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    ASSERT_NEAR(inverse.tendon_force[0], force, 1e-9) << i;  // rounding of w times its gains
    ASSERT_LT(inverse.applied_force.norm(), 1e-9) << i;
  }
}

/// The force of a servo with bounds that are not symmetric, and an input inside them.
TEST(Tendons, ServoStaysWithinItsBoundsAsByHand) {
  TendonSpec tendon;
  tendon.joints = {{"slide0", 0.5}};
  tendon.servo = {300.0, 20.0};
  tendon.servo.least = -10.0;
  tendon.servo.most = 45.0;
  tendon.servo_target = 0.0;
  Scene scene = blocks({1.5}, {tendon});
  const double h = scene.options.time_step, m = 1.5, c = 0.5, kp = 300.0, kd = 20.0;
  Simulator sim(std::move(scene));
  double q = 0.0, w = 0.0;
  int at_bound = 0, inside = 0;
  for (int i = 0; i < 600; ++i) {
    const double target = 0.3 * std::sin(0.02 * i), given = i < 300 ? 0.0 : 8.0 * std::cos(0.1 * i);
    sim.input().tendon_target = VectorX::Constant(1, target);
    sim.input().tendon_force = VectorX::Constant(1, given);
    const double pull = kp * (target - c * q) + given, weight = m * kStandardGravity;
    double next = (m * w + h * (c * pull - weight)) / (m + c * c * (h * kd + h * h * kp));
    double force = pull - (kd + h * kp) * c * next;
    const double bounded = std::clamp(force, tendon.servo.least, tendon.servo.most);
    if (bounded != force) next = w + h * (c * bounded - weight) / m;
    ++(bounded != force ? at_bound : inside);
    w = next;
    q += h * w;
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_NEAR(sim.state().v[0], w, kRoundoff) << i;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    ASSERT_NEAR(inverse.tendon_force[0], bounded, 1e-9) << i;
    ASSERT_NEAR(inverse.applied_force[0], 0.0, 1e-9) << i;
  }
  EXPECT_GT(at_bound, 50);
  EXPECT_GT(inside, 50);
}

/// A given force alone, on a path from the world to the block: the block accelerates upwards with
/// (F - m g) / m, since the path shortens as it rises.
TEST(Tendons, AnInputPullsAlongThePath) {
  TendonSpec rope;
  rope.path = {point("world", {0, 0, 2}), point("block0", {0, 0, 0})};
  Simulator sim(blocks({2.0}, {rope}));
  sim.input().tendon_force = VectorX::Constant(1, -30.0);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(sim.step().succeeded());
  const double h = sim.options().time_step;
  EXPECT_NEAR(sim.state().v[0], 20 * h * (15.0 - kStandardGravity), kRoundoff);
}

/// Bounds without gains hold for the input too, also where they leave out zero.
TEST(Tendons, AnInputStaysWithinTheBounds) {
  TendonSpec rope;
  rope.path = {point("world", {0, 0, 2}), point("block0", {0, 0, 0})};
  rope.servo.least = -25.0;
  rope.servo.most = -5.0;
  for (const auto& [given, pulled] : {std::pair(-30.0, 25.0), {-10.0, 10.0}, {0.0, 5.0}}) {
    Simulator sim(blocks({2.0}, {rope}));
    sim.input().tendon_force = VectorX::Constant(1, given);
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.state().v[0], sim.options().time_step * (pulled / 2.0 - kStandardGravity),
                kRoundoff);
  }
}

/// A rope of fixed length (both limits) over a wheel: Atwood's machine, a = g (m1 - m0) / (m1 +
/// m0). With the regularized limit the rope yields by the compliance times the forces.
TEST(Tendons, AtwoodsMachine) {
  TendonSpec rope;
  rope.path = {point("block0", {0, 0, 0}), wrap(Kind::kCylinder, "world", {0.5, 0, 2}, 0.5),
               point("block1", {0, 0, 0})};
  rope.path[1].side = Vector3(0, 1, 0);                      // above
  rope.path[1].X_LG.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // z of the cylinder across the plane
  // Both ends hang tangentially: the rope is 2 + pi r + 2 long.
  rope.lower = rope.upper = 4.0 + M_PI * 0.5;
  Simulator sim(blocks({1.0, 1.5}, {rope}));
  // A tangent point straight above each block needs the ends outside the wheel.
  EXPECT_NEAR(length_at(sim.model(), 0, sim.state().q), rope.upper, 1e-12);
  const int steps = 50;
  double tension = 0.0;
  for (int i = 0; i < steps; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    tension = sim.inverse(before.q, before.v, sim.state().v).tendon_force[0];
  }
  const double a = kStandardGravity * 0.5 / 2.5, t = steps * sim.options().time_step;
  EXPECT_NEAR(sim.state().v[0], a * t, 1e-5 * a * t);
  EXPECT_NEAR(sim.state().v[1], -a * t, 1e-5 * a * t);
  EXPECT_NEAR(tension, -1.0 * (kStandardGravity + a), 1e-4);
}

/// A block and tackle: block 1 hangs in a loop with the force doubled. With x the rise of block 0
/// and y that of block 1: L = ... - x + (-y) 2 / 2 ... the branch behind a pulley of divisor 2
/// moves half as much: m0 at rest if m1 = m0 / 2 by the shares of the branches.
TEST(Tendons, APulleyDividesTheForce) {
  TendonSpec rope;
  rope.path = {point("world", {0, 0, 2}), point("block0", {0, 0, 0}), pulley(2.0),
               point("world", {1, 0, 2}), point("block1", {0, 0, 0})};
  rope.upper = 3.0;  // 2 + 2 / 2
  Simulator sim(blocks({2.0, 1.0}, {rope}));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_LT(sim.state().v.norm(), 1e-6);  // 2 kg on a full branch balances 1 kg on half a branch
}

/// A slack rope does nothing; taut it holds the weight, and stretches by no more than the limit's
/// compliance gives, 1e-8 m.
TEST(Tendons, ARopeIsSlackThenTaut) {
  TendonSpec rope;
  rope.path = {point("world", {0, 0, 1}), point("block0", {0, 0, 0})};
  rope.upper = 1.2;
  Simulator sim(blocks({2.0}, {rope}));
  const double h = sim.options().time_step;
  double q = 0.0, w = 0.0, deepest = 0.0, force = 0.0;
  for (int i = 0; i < 400; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    w -= h * kStandardGravity;
    q += h * w;
    if (q > -0.19) {
      ASSERT_NEAR(sim.state().q[0], q, kRoundoff) << i;
    }
    deepest = std::min(deepest, sim.state().q[0]);
    force = sim.inverse(before.q, before.v, sim.state().v).tendon_force[0];
  }
  EXPECT_NEAR(deepest, -0.2, 1e-6);
  EXPECT_NEAR(force, -2.0 * kStandardGravity, 1e-6);
  EXPECT_LT(std::abs(sim.state().v[0]), 1e-6);
}

/// A spring that is slack between its rest lengths: beyond them the mean length is m g / k away.
TEST(Tendons, ASlackSpringPullsOnlyBeyondItsRestLengths) {
  TendonSpec spring;
  spring.path = {point("world", {0, 0, 1}), point("block0", {0, 0, 0})};
  spring.stiffness = 500.0;
  spring.rest = std::pair(0.9, 1.1);
  Scene scene = blocks({2.0}, {spring});
  Simulator sim(std::move(scene));
  const double h = sim.options().time_step;
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], -60 * h * kStandardGravity, kRoundoff);
  // It comes to rest by the damping h k of the implicit scheme.
  for (int i = 0; i < 40000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(length_at(sim.model(), 0, sim.state().q), 1.1 + 2.0 * kStandardGravity / 500.0, 1e-9);
}

TEST(Tendons, DryFrictionHoldsUpToItsBound) {
  for (const double friction : {19.0, 21.0}) {
    TendonSpec tendon;
    tendon.joints = {{"slide0", 1.0}};
    tendon.dry_friction = friction;
    Simulator sim(blocks({2.0}, {tendon}));
    const double h = sim.options().time_step, excess = 2.0 * kStandardGravity - friction;
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
    const double expected = excess > 0.0 ? -100 * h * excess / 2.0 : 0.0;
    EXPECT_NEAR(sim.state().v[0], expected, 1e-5) << friction;  // it creeps with eps g h
  }
}

TEST(Tendons, InverseRecoversTheForces) {
  for (int seed = 0; seed < 24; ++seed) {
    test::RandomModelOptions o = test::varied_options(seed);
    o.links = 3 + seed % 5;
    o.fixed_share = 0.0;
    o.tendons = 1 + seed % 4;
    o.tendon_friction = seed % 2 == 1;
    o.tendon_limits = seed % 3 == 2;
    test::Random random(500 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    scene.options.contact.compliance = 1e-4;  // test::kRecovered
    Simulator sim(std::move(scene));
    const auto n = static_cast<int>(sim.model().tendons().size());
    sim.input().tendon_force = test::random_vector(n, 7, 2.0);
    EXPECT_LE(test::recover(sim, 40, 5.0, random), test::kRecovered) << seed;
  }
}

/// The spring's energy, that of the weight and of the motion together: the implicit law loses some,
/// and none is gained.
TEST(Tendons, SpringsGainNoEnergy) {
  TendonSpec tendon;
  tendon.joints = {{"slide0", 0.5}, {"slide1", -0.3}};
  tendon.stiffness = 4000.0;
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    Scene scene = blocks({2.0, 0.7}, {tendon});
    scene.v << 1.0, -2.0;
    scene.options.integrator = integrator;
    const double h = scene.options.time_step;
    Simulator sim(std::move(scene));
    const auto energy = [&] {
      const State& s = sim.state();
      double sum = spring_energy(sim.model(), s.q);
      const double mass[] = {2.0, 0.7};
      for (int i = 0; i < 2; ++i)
        sum += mass[i] * (0.5 * s.v[i] * s.v[i] + kStandardGravity * s.q[i]);
      return sum;
    };
    const double start = energy();
    double highest = start;
    for (int i = 0; i < 500; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      highest = std::max(highest, energy());
    }
    // Weight and speed are taken half a step apart: h g v / 2 per mass, up to 10 m/s.
    EXPECT_LE(highest, start + 0.5 * h * kStandardGravity * 2.7 * 10.0);
  }
}

TEST(Tendons, AllocateNothing) {
  test::RandomModelOptions o;
  o.links = 8;
  o.fixed_share = 0.0;
  o.tendons = 6;
  o.tendon_friction = o.tendon_limits = true;
  test::Random random(3);
  Simulator sim(test::make_random_scene(3, o, random));
  sim.input().tendon_force = VectorX::Constant(6, 1.0);
  test::expect_no_allocations(sim, 50);
}

TEST(Tendons, BadOnesAreRefusedByName) {
  const auto message = [](TendonSpec tendon) {
    tendon.name = "bad";
    try {
      blocks({1.0, 1.0, 1.0}, {tendon});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Vector3 zero = Vector3::Zero();
  TendonSpec t;
  EXPECT_NE(message(t).find("either joints"), std::string::npos);
  t.joints = {{"slide9", 1.0}};
  EXPECT_NE(message(t).find("no joint 'slide9'"), std::string::npos);
  t.joints.clear();
  t.path = {point("block0", zero)};
  EXPECT_NE(message(t).find("two points"), std::string::npos);
  t.path.push_back(point("block7", zero));
  EXPECT_NE(message(t).find("no link 'block7'"), std::string::npos);
  t.path = {point("block0", zero), point("block0", Vector3(1, 0, 0))};
  EXPECT_NE(message(t).find("cannot change"), std::string::npos);
  t.path = {point("block0", zero), point("block1", zero), point("block2", zero)};
  EXPECT_NE(message(t).find("3 separate mechanisms"), std::string::npos);
  t.path = {point("world", zero), wrap(Kind::kSphere, "block0", zero, 0.1)};
  EXPECT_NE(message(t).find("between two points"), std::string::npos);
  t.path.push_back(point("block1", zero));
  t.path[1].side = Vector3(0.05, 0, 0);
  EXPECT_NE(message(t).find("inside the radius"), std::string::npos);
  t.path = {point("world", zero), point("block0", zero)};
  t.stiffness = -1.0;
  EXPECT_NE(message(t).find("stiffness"), std::string::npos);
  t.stiffness = 0.0;
  t.servo.most = 1.0;
  EXPECT_NE(message(t).find("two finite bounds"), std::string::npos);
}

}  // namespace
}  // namespace counterpoint::tendons_test
