// Nothing passes a thin wall within a step, at any speed or spin.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model.h"
#include "support/random_model.h"
#include "support/shape_reference.h"

namespace counterpoint::test::tunnelling_test {
namespace {

// A wall of 1 mm; at h = 2 ms and 300 m/s a body moves by 600 walls a step.
constexpr double kHalfWall = 0.0005;
const Shape kWall = box_shape({5.0, 5.0, kHalfWall});

RobotSpec object(const Shape& shape, double mass, double friction) {
  RobotSpec robot;
  robot.name = "object";
  LinkSpec link;
  link.name = "body";
  link.inertia = solid_inertia(shape, mass);
  LinkSpec::Collision collision;
  collision.shape = shape;
  collision.material.friction = friction;
  link.collisions.push_back(collision);
  robot.links.push_back(link);
  return robot;
}

Material with_friction(double friction) {
  Material material;
  material.friction = friction;
  return material;
}

Scene start(Model model) {
  VectorX q = model.default_q();
  VectorX v = VectorX::Zero(model.nv());
  return {"tunnelling", std::move(model), std::move(q), std::move(v), {}};
}

Pose pose_of(const VectorX& q, int first = 0) {
  return {Quaternion(q[first + 3], q[first + 4], q[first + 5], q[first + 6]).toRotationMatrix(),
          q.segment<3>(first)};
}

struct Thrown {
  const char* name;
  Shape shape;
  double reach;  // distance of the farthest point from the centre [m]
};

std::vector<Thrown> thrown() {
  return {{"ball of 5 mm", sphere_shape(0.0025), 0.0025},
          {"ball of 10 mm", sphere_shape(0.005), 0.005},
          {"cube", box_shape({0.01, 0.01, 0.01}), 0.018},
          {"plate of 1 mm", box_shape({0.1, 0.1, 0.0005}), 0.142},
          {"round rod", capsule_shape(0.0025, 0.25), 0.2525},
          {"square rod", box_shape({0.001, 0.001, 0.25}), 0.25},
          {"cylinder", cylinder_shape(0.0025, 0.25), 0.25}};
}

// Speed of the centre, and of the farthest point about it [m/s].
class Speeds : public ::testing::TestWithParam<std::pair<double, double>> {};

INSTANTIATE_TEST_SUITE_P(Tunnelling, Speeds,
                         ::testing::Values(std::pair(3.0, 0.0), std::pair(30.0, 30.0),
                                           std::pair(300.0, 0.0), std::pair(300.0, 30.0),
                                           std::pair(300.0, 300.0), std::pair(3.0, 300.0),
                                           std::pair(0.0, 300.0)));

// Throws a body at a shape below z = kHalfWall; its centre must stay above z = 0, and no step may
// fail. Returns whether it touched.
bool expect_stopped(const Thrown& t, const Shape& below, const Pose& X_below, double friction,
                    double speed, double tip, Random& random, const std::string& what) {
  ModelBuilder builder;
  builder.add_environment("below", below, X_below, with_friction(friction));
  builder.add_robot(object(t.shape, 1.0, friction), Base::kFloating, Pose{});
  Scene scene = start(builder.build());
  const Quaternion turn = random.quaternion();
  const double low = lowest_point(t.shape, {turn.toRotationMatrix(), Vector3::Zero()});
  // Starts at a random height within the distance of two steps.
  scene.q[2] = kHalfWall - low + 1e-3 + random.uniform(0.0, 1.0) * std::max(0.02, 0.004 * speed);
  scene.q.segment<4>(3) << turn.w(), turn.x(), turn.y(), turn.z();
  Vector3 way = random.unit_vector();
  way.z() = -std::abs(way.z()) - 0.2;
  scene.v << speed * way.normalized(), tip / t.reach * random.unit_vector();
  const double fall = scene.v[2];
  Simulator sim(std::move(scene));
  bool touched = false;
  for (int i = 0; i < 60; ++i) {
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << what << ", step " << i;
    const Pose X = pose_of(sim.state().q);
    if (below.type == ShapeType::kBox && X.translation.head<2>().norm() > 4.0)
      break;  // past the rim
    touched = touched || sim.state().v[2] > 0.9 * fall;
    EXPECT_GT(X.translation.z(), 0.0) << what << ", step " << i;
    if (::testing::Test::HasFailure()) break;
  }
  return touched;
}

TEST_P(Speeds, CentresStayOnTheirSideOfAWall) {
  const auto [speed, tip] = GetParam();
  for (const Thrown& t : thrown()) {
    Random random(1);
    int met = 0;
    for (int run = 0; run < 12; ++run) {
      met += expect_stopped(t, kWall, Pose{}, 0.5, speed, tip, random,
                            std::string(t.name) + ", run " + std::to_string(run));
    }
    if (tip <= 30.0 && speed > 0.0) {
      EXPECT_GT(met, 6) << t.name;
    }
  }
}

// Without friction nothing slows the spin, and the ends hit again and again.
TEST_P(Speeds, CentresStayAboveAPlaneWithoutFriction) {
  const auto [speed, tip] = GetParam();
  const Pose X_plane{Matrix3::Identity(), Vector3(0.0, 0.0, kHalfWall)};
  for (const Thrown& t : thrown()) {
    Random random(1);
    for (int run = 0; run < 12; ++run) {
      expect_stopped(t, plane_shape(), X_plane, 0.0, speed, tip, random,
                     std::string(t.name) + ", run " + std::to_string(run));
    }
  }
}

TEST(Tunnelling, BallAndFreePlateExchangeMomentum) {
  // A ball hits a free plate at rest, inelastically, without friction, through the centre: both
  // move on with the common velocity; the discrete equations contain nothing else.
  constexpr double kBall = 0.01, kPlate = 0.3;
  for (const double speed : {1.0, 30.0, 300.0}) {
    ModelBuilder builder(Vector3::Zero());
    const Shape plate = box_shape({0.1, 0.1, kHalfWall});
    builder.add_robot(object(plate, kPlate, 0.0), Base::kFloating, Pose{}, "plate/");
    builder.add_robot(object(sphere_shape(0.005), kBall, 0.0), Base::kFloating, Pose{}, "ball/");
    Scene scene = start(builder.build());
    scene.q[9] = 0.1;
    scene.v[8] = -speed;
    Simulator sim(std::move(scene));
    const int steps = static_cast<int>(0.2 / speed / 0.002) + 5;
    for (int i = 0; i < steps; ++i) ASSERT_TRUE(sim.step().succeeded());
    const double common = -speed * kBall / (kBall + kPlate);
    // The regularizer lets the normal row yield by eps of the impact speed, and several times that
    // at mu^2 r with the least mu.
    EXPECT_NEAR(sim.state().v[2], common, 1e-5 * speed);
    EXPECT_NEAR(sim.state().v[8], common, 1e-5 * speed);
    EXPECT_GT(sim.state().q[9], sim.state().q[2] + 0.005);
  }
}

TEST(Tunnelling, FastBallsSkidIntoRolling) {
  // A ball that hits a rough surface obliquely leaves it rolling: the horizontal speed is 5/7 of
  // its initial value, for any gap at the start of the step. Friction that acted halfway across the
  // gap would have an arm of many radii.
  constexpr double kRadius = 0.005;
  for (const double speed : {1.0, 20.0, 100.0}) {
    ModelBuilder builder(Vector3::Zero());
    builder.add_environment("wall", kWall, Pose{}, with_friction(2.0));
    builder.add_robot(object(sphere_shape(kRadius), 0.01, 2.0), Base::kFloating, Pose{});
    Scene scene = start(builder.build());
    const double h = scene.options.time_step;
    scene.q[2] = kHalfWall + kRadius + 0.7 * h * speed;
    scene.v[0] = speed;
    scene.v[2] = -speed;
    scene.options.contact.friction_model = FrictionModel::kCoulomb;
    const double scene_slip_time = scene.options.contact.slip_time;
    Simulator sim(std::move(scene));
    ASSERT_TRUE(sim.step().succeeded());
    // Compliance, as above; and friction may slip in this step by a share of h / slip_time of the
    // sliding speed before it.
    const double allowed = (1e-4 + h / scene_slip_time) * speed;
    EXPECT_NEAR(sim.state().v[0], 5.0 / 7.0 * speed, allowed);
    EXPECT_NEAR(sim.state().v[4] * kRadius, 5.0 / 7.0 * speed, allowed);
  }
}

TEST(Tunnelling, FastBallsAreStoppedAtTheWallAndNotBefore) {
  // At any angle and at any time of impact within the step: the first step ends on the wall, and
  // the next ones stay on it. Friction is Coulomb's, or leaves the ball rolling.
  constexpr double kRadius = 0.05, kFriction = 0.5;
  for (const double speed : {10.0, 100.0, 1000.0}) {
    for (const double degrees : {5.0, 20.0, 35.0, 60.0, 85.0}) {
      for (const double phase : {0.1, 0.5, 0.9}) {
        SCOPED_TRACE(::testing::Message() << speed << " m/s, " << degrees << ", " << phase);
        const double angle = degrees * M_PI / 180.0;
        const double along = speed * std::cos(angle), down = speed * std::sin(angle);
        ModelBuilder builder(Vector3::Zero());
        builder.add_environment("wall", plane_shape(), Pose{}, with_friction(kFriction));
        builder.add_robot(object(sphere_shape(kRadius), 1.0, kFriction), Base::kFloating, Pose{});
        Scene scene = start(builder.build());
        const double h = scene.options.time_step, slip_time = scene.options.contact.slip_time;
        scene.q[2] = kRadius + phase * h * down;
        scene.v[0] = along;
        scene.v[2] = -down;
        Simulator sim(std::move(scene));
        // The normal row yields by mu^2 eps of the impact, times sqrt(1 + mu^2) and a small factor.
        const double give = 1e-5 * speed;
        for (int i = 0; i < 5; ++i) {
          ASSERT_TRUE(sim.step().succeeded());
          ASSERT_NEAR(sim.state().q[2], kRadius, h * give) << "step " << i;
        }
        EXPECT_NEAR(sim.state().v[2], 0.0, give);
        // In each of these steps friction may slip by a share of h / slip_time of the sliding
        // speed.
        const double slow = std::max(along - kFriction * down, 5.0 / 7.0 * along);
        EXPECT_NEAR(sim.state().v[0], slow, give + 5.0 * h / slip_time * along);
      }
    }
  }
}

/// All shapes but balls cross gaps beyond the margin by the convex law: they stop short of the wall
/// by h mu |v_T| at most, and may leave it again (docs/explanation/concepts.md, "Fast bodies").
TEST(Tunnelling, OtherFastBodiesStopShortOfTheWall) {
  constexpr double kFriction = 0.5, kHalf = 0.05;
  double farthest = 0.0;
  for (const double degrees : {5.0, 20.0, 35.0, 60.0}) {
    for (const double phase : {0.1, 0.5, 0.9}) {
      const double angle = degrees * M_PI / 180.0, speed = 1000.0;
      ModelBuilder builder(Vector3::Zero());
      builder.add_environment("wall", plane_shape(), Pose{}, with_friction(kFriction));
      builder.add_robot(object(box_shape({kHalf, kHalf, kHalf}), 1.0, kFriction), Base::kFloating,
                        Pose{});
      Scene scene = start(builder.build());
      const double h = scene.options.time_step;
      scene.q[2] = kHalf + phase * h * speed * std::sin(angle);
      scene.v[0] = speed * std::cos(angle);
      scene.v[2] = -speed * std::sin(angle);
      Simulator sim(std::move(scene));
      ASSERT_TRUE(sim.step().succeeded());
      const double gap = sim.state().q[2] - kHalf * std::sqrt(3.0);  // for any orientation
      EXPECT_LE(gap, h * kFriction * speed * std::cos(angle));
      farthest = std::max(farthest, gap);
    }
  }
  RecordProperty("farthest_m", std::to_string(farthest));
}

TEST(Tunnelling, WhatIsStruckDoesNotPassEither) {
  // Balls at rest before a wall; the last one comes at 300 m/s, and all impacts are in one step.
  ModelBuilder builder(Vector3::Zero());
  builder.add_environment("wall", kWall, Pose{}, with_friction(0.0));
  for (int i = 0; i < 4; ++i) {
    builder.add_robot(object(sphere_shape(0.005), 0.01, 0.0), Base::kFloating, Pose{},
                      std::to_string(i) + "/");
  }
  Scene scene = start(builder.build());
  for (int i = 0; i < 4; ++i) scene.q[7 * i + 2] = 0.05 + 0.03 * i;
  scene.v[6 * 3 + 2] = -300.0;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    for (int k = 0; k < 4; ++k) ASSERT_GT(sim.state().q[7 * k + 2], 0.005) << "ball " << k;
  }
}

TEST(Tunnelling, TheInverseSeesTheSameContacts) {
  // Margins depend on (q, w) only: the inverse recovers the force applied in the fastest step.
  Random random(5);
  for (const Thrown& t : thrown()) {
    ModelBuilder builder;
    builder.add_environment("wall", kWall, Pose{}, with_friction(0.5));
    builder.add_robot(object(t.shape, 1.0, 0.5), Base::kFloating, Pose{});
    Scene scene = start(builder.build());
    const Quaternion turn = random.quaternion();
    scene.q[2] = 0.1 - lowest_point(t.shape, {turn.toRotationMatrix(), Vector3::Zero()});
    scene.q.segment<4>(3) << turn.w(), turn.x(), turn.y(), turn.z();
    scene.v << 20.0, 10.0, -100.0, 5.0 * random.unit_vector();
    Simulator sim(std::move(scene));
    sim.input().applied_force << 3.0, -2.0, 1.0, 0.01, 0.02, -0.01;
    int contacts = 0;
    for (int i = 0; i < 5; ++i) {
      const State before = sim.state();
      const StepReport report = sim.step();
      ASSERT_TRUE(report.succeeded()) << t.name;
      contacts += report.contacts;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      // The solver's round-off floor, 1e-9 at most here, relative to an impact of 5e4 N: rods spin
      // at 4e4 rad/s after it, and their contact velocity is a difference of such speeds. Later the
      // rounding of 100 m/s, 1e-14, over the regularizer of 1e-6 / kg: 5e-6 N over 2 ms.
      EXPECT_LT((inverse.applied_force - sim.input().applied_force).norm(),
                3e-8 * inverse.force_scale + 1e-5)
          << t.name;
    }
    EXPECT_GT(contacts, 0);
  }
}

}  // namespace
}  // namespace counterpoint::test::tunnelling_test
