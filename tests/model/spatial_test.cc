#include "counterpoint/model/spatial.h"

#include <gtest/gtest.h>

#include "support/random_model.h"

namespace counterpoint::spatial_test {
namespace {

constexpr double kRoundoff = 1e-13;  // round-off of chains of products of numbers of order one

class SpatialTest : public testing::TestWithParam<int> {
 protected:
  SpatialTest() : random_(static_cast<std::uint64_t>(GetParam())) {}
  Motion motion() { return {random_.vector(1), random_.vector(1)}; }
  Force force() { return {random_.vector(1), random_.vector(1)}; }
  Pose pose() { return test::random_pose(random_, 1); }
  test::Random random_;
};
INSTANTIATE_TEST_SUITE_P(Random, SpatialTest, testing::Range(0, 10));

void expect_near(const Motion& a, const Motion& b) {
  EXPECT_LT((a.angular - b.angular).norm() + (a.linear - b.linear).norm(), kRoundoff);
}
void expect_near(const Force& a, const Force& b) {
  EXPECT_LT((a.torque - b.torque).norm() + (a.force - b.force).norm(), kRoundoff);
}

TEST_P(SpatialTest, PowerDoesNotDependOnTheFrame) {
  const Pose X = pose();
  const Motion v = motion();
  const Force f = force();
  EXPECT_NEAR(dot(X * v, X * f), dot(v, f), kRoundoff);
}

TEST_P(SpatialTest, PosesComposeAndInvert) {
  const Pose X_AB = pose();
  const Pose X_BC = pose();
  const Motion v = motion();
  const Force f = force();
  const Vector3 p = random_.vector(1);
  EXPECT_LT(((X_AB * X_BC) * p - X_AB * (X_BC * p)).norm(), kRoundoff);
  EXPECT_LT((X_AB.inverse() * (X_AB * p) - p).norm(), kRoundoff);
  expect_near((X_AB * X_BC) * v, X_AB * (X_BC * v));
  expect_near((X_AB * X_BC) * f, X_AB * (X_BC * f));
  expect_near(X_AB.inverse_apply(v), X_AB.inverse() * v);
  expect_near(X_AB.inverse_apply(f), X_AB.inverse() * f);
  expect_near(X_AB.inverse_apply(X_AB * v), v);
  expect_near(X_AB.inverse_apply(X_AB * f), f);
}

TEST_P(SpatialTest, TransformedMotionMovesPointsAlike) {
  const Pose X = pose();
  const Motion v = motion();
  const Vector3 p = random_.vector(1);
  EXPECT_LT(((X * v).at(X * p) - X.rotation * v.at(p)).norm(), kRoundoff);
}

TEST_P(SpatialTest, CrossProductsAreDualAndCovariant) {
  const Pose X = pose();
  const Motion v = motion();
  const Motion m = motion();
  const Force f = force();
  EXPECT_NEAR(dot(cross(v, m), f), -dot(m, cross(v, f)), kRoundoff);
  expect_near(cross(v, v), Motion());
  expect_near(X * cross(v, m), cross(X * v, X * m));
  expect_near(X * cross(v, f), cross(X * v, X * f));
}

TEST_P(SpatialTest, InertiaIsTheSameInEveryFrame) {
  const Pose X = pose();
  const SpatialInertia inertia = test::random_inertia(random_);
  const Motion v = motion();
  expect_near(X * (inertia * v), inertia.transformed(X) * (X * v));
  // The matrix form, and the kinetic energy of and about the centre of mass.
  Vector6 v6;
  v6 << v.angular, v.linear;
  const Force momentum = inertia * v;
  Vector6 expected;
  expected << momentum.torque, momentum.force;
  EXPECT_LT((inertia.matrix() * v6 - expected).norm(), kRoundoff);
  EXPECT_LT((inertia.matrix() - inertia.matrix().transpose()).norm(), kRoundoff);
  const double energy = inertia.mass * v.at(inertia.center).squaredNorm() +
                        v.angular.dot(inertia.rotational * v.angular);
  EXPECT_NEAR(dot(v, momentum), energy, kRoundoff);
}

TEST_P(SpatialTest, WeldedInertiasAdd) {
  const SpatialInertia a = test::random_inertia(random_);
  const SpatialInertia b = test::random_inertia(random_);
  EXPECT_LT(((a + b).matrix() - (a.matrix() + b.matrix())).norm(), kRoundoff);
  EXPECT_LT(((a + SpatialInertia()).matrix() - a.matrix()).norm(), kRoundoff);
  EXPECT_LT(((SpatialInertia() + a).matrix() - a.matrix()).norm(), kRoundoff);
}

TEST(Spatial, KnownValues) {
  // Rotation about z at 2 rad/s: the point 1 m along x moves at 2 m/s along y.
  EXPECT_EQ((Motion{{0, 0, 2}, {0, 0, 0}}.at({1, 0, 0})), Vector3(0, 2, 0));
  // A force of 3 N along y at 1 m along x: 3 N m about z.
  const Pose shift{Matrix3::Identity(), {1, 0, 0}};
  EXPECT_EQ((shift * Force{{0, 0, 0}, {0, 3, 0}}).torque, Vector3(0, 0, 3));
}

}  // namespace
}  // namespace counterpoint::spatial_test
