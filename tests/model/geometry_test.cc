#include "counterpoint/model/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "counterpoint/model/model.h"
#include "support/random_model.h"

namespace counterpoint::geometry_test {
namespace {

constexpr double kRoundoff = 1e-13;

TEST(LowestPoint, KnownPoses) {
  const Matrix3 tilt = rotation_from_rpy(std::numbers::pi / 4, 0, 0);
  const Pose X{tilt, {1, 2, 3}};
  const double half_root = std::sqrt(0.5);
  EXPECT_EQ(lowest_point({ShapeType::kSphere, {0.5, 0, 0}, nullptr}, X), 2.5);
  EXPECT_NEAR(lowest_point({ShapeType::kBox, {5, 1, 1}, nullptr}, X), 3 - std::sqrt(2.0),
              kRoundoff);
  EXPECT_NEAR(lowest_point({ShapeType::kCapsule, {0.5, 1, 0}, nullptr}, X), 2.5 - half_root,
              kRoundoff);
  EXPECT_NEAR(lowest_point({ShapeType::kCylinder, {0.5, 1, 0}, nullptr}, X), 3 - 1.5 * half_root,
              kRoundoff);
  EXPECT_EQ(lowest_point({ShapeType::kPlane, {}, nullptr}, X),
            -std::numeric_limits<double>::infinity());
}

TEST(LowestPoint, BoxAndItsHullAgree) {
  const Vector3 half(0.1, 0.2, 0.3);
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(half.cwiseProduct(Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  const Shape hull{ShapeType::kConvexMesh, {}, make_convex_hull(corners)};
  const Shape box{ShapeType::kBox, half, nullptr};
  test::Random random(9);
  for (int i = 0; i < 20; ++i) {
    const Pose X = test::random_pose(random, 1);
    EXPECT_NEAR(lowest_point(hull, X), lowest_point(box, X), kRoundoff);
  }
}

TEST(Materials, Combine) {
  const Material a{0.9, 0.2, 0.04, 0.0};
  const Material b{0.4, 0.5, 0.01, 0.02};
  const Material m = combine_materials(a, b);
  EXPECT_NEAR(m.friction, 0.6, kRoundoff);
  EXPECT_EQ(m.restitution, 0.5);
  EXPECT_EQ(m.torsional_friction, 0.04);
  EXPECT_EQ(m.rolling_friction, 0.02);  // a pair has it if one of its surfaces has
  EXPECT_EQ(combine_materials(b, a).friction, m.friction);
}

TEST(SolidInertia, AgreesWithMonteCarlo) {
  const Shape shapes[] = {{ShapeType::kSphere, {0.3, 0, 0}, nullptr},
                          {ShapeType::kBox, {0.1, 0.2, 0.3}, nullptr},
                          {ShapeType::kCylinder, {0.2, 0.3, 0}, nullptr},
                          {ShapeType::kCapsule, {0.2, 0.3, 0}, nullptr}};
  const auto inside = [](const Shape& shape, const Vector3& p) {
    const double radial = std::hypot(p.x(), p.y());
    const Vector3& s = shape.size;
    switch (shape.type) {
      case ShapeType::kSphere:
        return p.norm() < s[0];
      case ShapeType::kBox:
        return (p.cwiseAbs().array() < s.array()).all();
      case ShapeType::kCylinder:
        return radial < s[0] && std::abs(p.z()) < s[1];
      default:
        return std::hypot(radial, std::max(0.0, std::abs(p.z()) - s[1])) < s[0];
    }
  };
  // At least 48,000 points hit the smallest shape: an entry has a standard error of 0.5 %; the
  // tolerance is four of them.
  constexpr int kSamples = 1000000;
  constexpr double kSampling = 2e-2;
  test::Random random(21);
  for (const Shape& shape : shapes) {
    Matrix3 sum = Matrix3::Zero();
    int count = 0;
    for (int i = 0; i < kSamples; ++i) {
      const Vector3 p = random.vector(0.5);
      if (!inside(shape, p)) continue;
      sum += p.squaredNorm() * Matrix3::Identity() - p * p.transpose();
      ++count;
    }
    const Matrix3 expected = 2.0 / count * sum;
    const Matrix3 found = solid_inertia(shape, 2.0).rotational;
    EXPECT_LT((found - expected).norm(), kSampling * expected.norm());
  }
  EXPECT_NEAR(solid_inertia(shapes[3], 1).rotational(2, 2),
              (0.2 * 0.2) * (0.5 * 0.6 / (0.6 + 0.8 / 3) + 0.4 * (0.8 / 3) / (0.6 + 0.8 / 3)),
              kRoundoff);
}

}  // namespace
}  // namespace counterpoint::geometry_test
