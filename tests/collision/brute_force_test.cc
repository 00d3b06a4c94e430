// Signed distances against closed forms and brute force over all features, sizes from 1 mm to 1 km.
#include "support/brute_force.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/spatial.h"
#include "support/random_poses.h"
#include "support/record_largest.h"

namespace counterpoint::test::brute_force_test {
namespace {

// Relative to the size of the pair. Coordinates have a relative round-off of 1e-16; the gaps of one
// pair count as equal within 1e-10.
constexpr double kGapError = 1e-9;

double signed_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  Manifold m;
  collision::pair_contacts(a, X_A, b, X_B, std::numeric_limits<double>::infinity(), m);
  return deepest(m).gap;
}

// Radius of a ball around the origin of the shape's frame that contains the shape.
double reach(const Shape& shape) {
  if (!shape.mesh) return shape.size.sum();
  return shape.mesh->interior_point.norm() + shape.mesh->radius;
}

double log_uniform(std::mt19937& rng, double low, double high) {
  return low * std::pow(high / low, std::uniform_real_distribution<double>(0.0, 1.0)(rng));
}

// Draws a random pose of B, from inside A to slightly outside.
void draw_poses(std::mt19937& rng, const Shape& a, const Shape& b, Pose& X_A, Pose& X_B) {
  const double size = reach(a) + reach(b);
  X_A = random_pose(rng, size);
  const double away = std::uniform_real_distribution<double>(0.0, 1.3)(rng);
  X_B = {random_rotation(rng), X_A.translation + away * size * random_unit(rng)};
}

// Hull of random points in a shell of an ellipsoid, at 0.7 to 1 times its half axes.
Shape random_hull(std::mt19937& rng, int points, const Vector3& half) {
  std::vector<Vector3> cloud;
  for (int i = 0; i < points; ++i) {
    const double r = std::uniform_real_distribution<double>(0.7, 1.0)(rng);
    cloud.push_back(r * half.cwiseProduct(random_unit(rng)));
  }
  return hull_shape(cloud);
}

Vector3 random_half(std::mt19937& rng, double size) {
  return {size * log_uniform(rng, 0.1, 1.0), size * log_uniform(rng, 0.1, 1.0),
          size * log_uniform(rng, 0.1, 1.0)};
}

enum Kind { kBall, kBrick, kPill, kFewCorners, kManyCorners };
constexpr int kKinds = 5;
const char* const kNames[] = {"sphere", "box", "capsule", "hull6", "hull24"};

Shape random_shape(std::mt19937& rng, int kind, double size) {
  const Vector3 half = random_half(rng, size);
  switch (kind) {
    case kBall:
      return sphere_shape(half[0]);
    case kBrick:
      return box_shape(half);
    case kPill:
      return capsule_shape(half[0], half[1]);
    case kFewCorners:
      return random_hull(rng, 6, half);
    default:
      return random_hull(rng, 24, half);
  }
}

class BruteForce : public ::testing::TestWithParam<std::tuple<int, int>> {};

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& info) {
  return std::string(kNames[std::get<0>(info.param)]) + "_" + kNames[std::get<1>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(All, BruteForce,
                         ::testing::Combine(::testing::Range(0, kKinds),
                                            ::testing::Range(0, kKinds)),
                         pair_name);

TEST_P(BruteForce, SignedDistanceFromMillimetreToKilometre) {
  const auto [kind_a, kind_b] = GetParam();
  const int samples = kind_a == kManyCorners || kind_b == kManyCorners ? 40 : 300;
  std::mt19937 rng(100 * kind_a + kind_b);
  int overlapping = 0;
  RecordLargest error("gap_error_over_size");
  for (int i = 0; i < samples; ++i) {
    const double size = log_uniform(rng, 1e-3, 1e3);
    const Shape a = random_shape(rng, kind_a, size);
    const Shape b = random_shape(rng, kind_b, size);
    Pose X_A, X_B;
    draw_poses(rng, a, b, X_A, X_B);
    const double expected = brute_force_distance(a, X_A, b, X_B);
    const double scale = reach(a) + reach(b);
    EXPECT_LT(std::abs(error((signed_distance(a, X_A, b, X_B) - expected) / scale)), kGapError)
        << "sample " << i << ", size " << size << " m";
    overlapping += expected < 0.0;
  }
  EXPECT_GT(overlapping, samples / 10);
  EXPECT_LT(overlapping, samples);
}

// A small shape on a large one; errors are relative to the large one.
TEST_P(BruteForce, SmallOnLarge) {
  const auto [kind_a, kind_b] = GetParam();
  std::mt19937 rng(7 + 100 * kind_a + kind_b);
  RecordLargest error("gap_error_over_size");
  for (int i = 0; i < 20; ++i) {
    const Shape a = random_shape(rng, kind_a, log_uniform(rng, 10.0, 1000.0));
    const Shape b = random_shape(rng, kind_b, log_uniform(rng, 1e-3, 0.1));
    Pose X_A, X_B;
    draw_poses(rng, a, b, X_A, X_B);
    // Moves B to the surface and into it by about the size of B.
    for (int k = 0; k < 8; ++k) {
      const double gap = brute_force_distance(a, X_A, b, X_B);
      X_B.translation -= (gap + 0.2 * reach(b)) * (X_B.translation - X_A.translation).normalized();
    }
    const double expected = brute_force_distance(a, X_A, b, X_B);
    EXPECT_LT(std::abs(error((signed_distance(a, X_A, b, X_B) - expected) / reach(a))), kGapError)
        << i;
  }
}

// Balls against shapes with a closed-form signed distance function, centres inside and outside.
TEST(ClosedForm, BallAgainstBoxCylinderAndPlane) {
  std::mt19937 rng(1);
  int inside = 0;
  RecordLargest error("gap_error_over_size");
  for (int i = 0; i < 3000; ++i) {
    const double size = log_uniform(rng, 1e-3, 1e3);
    const Shape ball = sphere_shape(size * log_uniform(rng, 1e-3, 1.0));
    const Shape box = box_shape(random_half(rng, size));
    const Shape cylinder = cylinder_shape(box.size[0], box.size[1]);
    const Pose X = random_pose(rng, size);
    const Pose X_ball{random_rotation(rng), X.translation + random_vector(rng, size)};
    const Vector3 p = X.inverse() * X_ball.translation;
    const double scale = reach(ball) + reach(box);

    const Vector3 q = p.cwiseAbs() - box.size;
    const double to_box = q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
    const auto expect_gap = [&](const Shape& shape, double expected) {
      const double off = signed_distance(ball, X_ball, shape, X) - (expected - ball.size[0]);
      EXPECT_LT(std::abs(error(off / scale)), kGapError);
    };
    expect_gap(box, to_box);
    const double radial = std::hypot(p.x(), p.y()) - cylinder.size[0];
    const double axial = std::abs(p.z()) - cylinder.size[1];
    const double to_cylinder = std::hypot(std::max(radial, 0.0), std::max(axial, 0.0)) +
                               std::min(std::max(radial, axial), 0.0);
    expect_gap(cylinder, to_cylinder);
    expect_gap(plane_shape(), p.z());
    inside += to_box < 0.0;
  }
  EXPECT_GT(inside, 100);
}

// The gap to a plane is the support height of the other shape.
TEST(ClosedForm, PlaneAgainstEverything) {
  std::mt19937 rng(2);
  RecordLargest error("gap_error_over_size");
  for (int i = 0; i < 1000; ++i) {
    const double size = log_uniform(rng, 1e-3, 1e3);
    const Vector3 half = random_half(rng, size);
    const Pose X_P = random_pose(rng, size);
    const Vector3 n = X_P.rotation.col(2);
    for (const Shape& shape :
         {sphere_shape(half[0]), box_shape(half), capsule_shape(half[0], half[1]),
          cylinder_shape(half[0], half[1]), random_hull(rng, 12, half)}) {
      const Pose X = random_pose(rng, size);
      const double expected = -support_height(shape, X, -n) - n.dot(X_P.translation);
      const double off = signed_distance(plane_shape(), X_P, shape, X) - expected;
      EXPECT_LT(std::abs(error(off / size)), kGapError);
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::brute_force_test
