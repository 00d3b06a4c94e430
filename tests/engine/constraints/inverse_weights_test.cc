// Constant inverse masses that scale regularizers, against bodies of known inverse inertia.
#include "counterpoint/engine/dynamics/inverse_weights.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/model_builder.h"
#include "support/random_model.h"

namespace counterpoint::inverse_weights_test {
namespace {

constexpr double kRoundoff = 1e-12;

InverseWeights weights_of(const Model& model) {
  Data data(model);
  return compute_inverse_weights(model, data);
}

RobotSpec make_object(const Shape& shape, const SpatialInertia& inertia, const Pose& X_LG) {
  RobotSpec robot;
  robot.name = "object";
  LinkSpec link;
  link.name = "body";
  link.inertia = inertia.transformed(X_LG);
  link.collisions.push_back({"", X_LG, shape, {}});
  robot.links.push_back(link);
  return robot;
}

TEST(ContactWeight, OfAFreeSolidIsOneOverItsMassWhateverItsShape) {
  const double mass = 2.5;
  const Shape shapes[] = {{ShapeType::kSphere, {0.1, 0, 0}, nullptr},
                          {ShapeType::kBox, {0.1, 0.1, 0.1}, nullptr},
                          {ShapeType::kBox, {0.5, 0.5, 0.001}, nullptr},
                          {ShapeType::kBox, {0.001, 0.001, 0.5}, nullptr},
                          {ShapeType::kCylinder, {0.001, 0.5, 0}, nullptr},
                          {ShapeType::kCylinder, {0.5, 0.001, 0}, nullptr},
                          {ShapeType::kCapsule, {0.001, 0.5, 0}, nullptr}};
  test::Random random(4);
  for (const Shape& shape : shapes) {
    // At a random pose in its link's frame: only the body counts.
    ModelBuilder builder;
    builder.add_robot(
        make_object(shape, solid_inertia(shape, mass), test::random_pose(random, 2.0)),
        Base::kFloating, test::random_pose(random, 1.0));
    const InverseWeights weights = weights_of(builder.build());
    EXPECT_EQ(weights.contact[0], 0.0);
    // A rod of 1 mm about 2 m from its link's origin: 1e-16 times the square of that ratio, 4e6.
    EXPECT_NEAR(weights.contact[1], 1.0 / mass, 1e-9) << static_cast<int>(shape.type);
  }
}

TEST(ContactWeight, OfAWheelOnItsAxleIsAShareOfItsRim) {
  // Its centre cannot move; the rim responds to a push along it with r^2 / I = 2 / m. The weight is
  // a twentieth of that: half of a tenth.
  const double mass = 2.0, radius = 0.3;
  const Shape shape{ShapeType::kCylinder, {radius, 0.05, 0}, nullptr};
  RobotSpec robot = make_object(shape, solid_inertia(shape, mass), Pose());
  LinkSpec base;
  base.name = "base";
  robot.links.push_back(base);
  JointSpec axle;
  axle.name = "axle";
  axle.parent = "base";
  axle.child = "body";
  axle.axis = Vector3::UnitZ();
  robot.joints.push_back(axle);
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  EXPECT_NEAR(weights_of(builder.build()).contact[1], 0.05 * 2.0 / mass, kRoundoff);
}

/// Two free spheres of these masses, 1 m apart, with a closure from `anchor_a` to b's centre.
Model two_spheres(double mass_a, double mass_b, ClosureType type, const Vector3& anchor_a) {
  ModelBuilder builder;
  const Shape shape{ShapeType::kSphere, {0.1, 0, 0}, nullptr};
  Pose X_WL;
  builder.add_robot(make_object(shape, solid_inertia(shape, mass_a), Pose()), Base::kFloating, X_WL,
                    "a/");
  X_WL.translation.x() = 1.0;
  builder.add_robot(make_object(shape, solid_inertia(shape, mass_b), Pose()), Base::kFloating, X_WL,
                    "b/");
  ClosureSpec closure;
  closure.type = type;
  closure.link_a = "a/body";
  closure.link_b = "b/body";
  closure.anchor_a = anchor_a;
  closure.anchor_b = Vector3::Zero();
  builder.add_closure(closure);
  return builder.build();
}

TEST(ClosureWeight, IsTheMeanInverseInertiaBetweenTheAnchors) {
  const double a = 2.0, b = 5.0, inertia_a = 0.4 * a * 0.01, inertia_b = 0.4 * b * 0.01;
  for (const ClosureType type : {ClosureType::kBall, ClosureType::kWeld, ClosureType::kDistance}) {
    const InverseWeights at_centre = weights_of(two_spheres(a, b, type, Vector3::Zero()));
    EXPECT_NEAR(at_centre.closure[0].linear, 1 / a + 1 / b, kRoundoff);
    EXPECT_NEAR(at_centre.closure[0].angular, 1 / inertia_a + 1 / inertia_b, 1e2 * kRoundoff);
    // An arm adds arm^2 / I in two of three directions.
    const InverseWeights off = weights_of(two_spheres(a, b, type, Vector3(0, 0.3, 0)));
    EXPECT_NEAR(off.closure[0].linear, 1 / a + 1 / b + 2.0 / 3.0 * 0.09 / inertia_a,
                1e2 * kRoundoff);
  }
}

TEST(ClosureWeight, NothingToHoldIsAnError) {
  // A ball closure at a revolute joint: parent and child cannot move apart there.
  RobotSpec robot;
  robot.name = "arm";
  for (const char* name : {"base", "upper", "lower"}) {
    LinkSpec link;
    link.name = name;
    if (link.name != "base") link.inertia = {1.0, Vector3(0.3, 0, 0), 0.1 * Matrix3::Identity()};
    robot.links.push_back(link);
  }
  for (int i = 0; i < 2; ++i) {
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = robot.links[i].name;
    joint.child = robot.links[i + 1].name;
    joint.axis = Vector3::UnitY();
    joint.X_PJ.translation = Vector3(0.6 * i, 0, 0);
    robot.joints.push_back(joint);
  }
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  ClosureSpec closure;
  closure.name = "twice";
  closure.link_a = "upper";
  closure.link_b = "lower";
  closure.anchor_a = Vector3(0.6, 0, 0);
  builder.add_closure(closure);
  const Model model = builder.build();
  try {
    weights_of(model);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("closure 'twice'"), std::string::npos);
  }
}

TEST(VelocityAcceleration, IsTheDerivativeOfVelocityAtConstantJointVelocities) {
  // Every joint type; central differences of 1e-5 s: an error of 1e-10 of the third derivative.
  for (int seed = 0; seed < 20; ++seed) {
    const Model model = test::make_random_model(seed);
    const VectorX q = test::random_configuration(model, seed + 1),
                  v = test::random_vector(model.nv(), seed + 2);
    Data data(model);
    const double step = 1e-5;
    std::vector<Motion> velocity[2];
    VectorX moved = q;
    for (int side = 0; side < 2; ++side) {
      integrate_configuration(model, q, v, side == 0 ? -step : step, moved);
      compute_poses(model, moved, data);
      compute_velocities(model, v, data);
      velocity[side] = data.V;
    }
    compute_poses(model, q, data);
    compute_velocities(model, v, data);
    std::vector<Motion> A(model.num_bodies());
    compute_velocity_accelerations(model, data, A);
    for (int b = 1; b < model.num_bodies(); ++b) {
      const Motion change = velocity[1][b] - velocity[0][b];
      // Acceleration of the moving origin: spatial acceleration lacks the convective term.
      const Vector3 linear = A[b].linear + data.V[b].angular.cross(data.V[b].linear);
      const double scale = 1.0 + linear.norm() + A[b].angular.norm();
      EXPECT_LT((change.linear / (2 * step) - linear).norm(), 1e-7 * scale) << seed << " " << b;
      EXPECT_LT((change.angular / (2 * step) - A[b].angular).norm(), 1e-7 * scale);
    }
  }
}

}  // namespace
}  // namespace counterpoint::inverse_weights_test
