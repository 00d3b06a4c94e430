// Signed distances of every pair of convex shapes against an independent implementation, the
// Flexible Collision Library (FCL), which iterates with libccd.
#include <gtest/gtest.h>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "support/fcl_shapes.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::fcl_oracle_test {
namespace {

struct Solid {
  std::string name;
  Shape shape;
};

// Built once, since the test names query it hundreds of times.
const std::vector<Solid>& solids() {
  static const std::vector<Solid> kSolids{
      {"sphere", sphere_shape(0.4)},         {"box", box_shape({0.3, 0.5, 0.2})},
      {"capsule", capsule_shape(0.2, 0.5)},  {"cylinder", cylinder_shape(0.3, 0.4)},
      {"hexagon", prism_shape(6, 0.4, 0.3)}, {"frustum", prism_shape(32, 0.4, 0.3, 0.5)}};
  return kSolids;
}

double fcl_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B,
                    double tolerance) {
  fcl::DistanceRequestd request;
  request.enable_signed_distance = true;
  request.distance_tolerance = tolerance;
  fcl::DistanceResultd result;
  return fcl::distance(fcl_geometry(a).get(), fcl_pose(X_A), fcl_geometry(b).get(), fcl_pose(X_B),
                       request, result);
}

double our_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  Manifold m;
  collision::pair_contacts(a, X_A, b, X_B, 10.0, m);
  return deepest(m).gap;
}

class FclOracle : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const Shape a = solids()[std::get<0>(GetParam())].shape;
  const Shape b = solids()[std::get<1>(GetParam())].shape;
  std::mt19937 rng{42};
};

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& info) {
  return solids()[std::get<0>(info.param)].name + "_" + solids()[std::get<1>(info.param)].name;
}

INSTANTIATE_TEST_SUITE_P(All, FclOracle,
                         ::testing::Combine(::testing::Range(0, 6), ::testing::Range(0, 6)),
                         pair_name);

// libccd stops when an iteration shortens the distance by less than its tolerance. On curved shapes
// the sum of the remaining iterations is then missing: at 1e-12 up to 1e-6 m for shapes of this
// size, mostly 1e-9 (at its default of 1e-6: up to 7e-4). Its distance is always too large, since
// its points lie in the shapes.
TEST_P(FclOracle, GapOfSeparatedShapes) {
  constexpr double kTolerance = 1e-12;
  constexpr double kFclError = 2e-6;
  constexpr double kOurError = 2e-8;  // gaps within 1e-9 times the size count as equal
  std::vector<double> errors;
  for (int i = 0; i < 120; ++i) {
    const Pose X_A = random_pose(rng, 0.5);
    const Pose X_B{random_rotation(rng), X_A.translation + random_vector(rng, 1.5)};
    const double gap = our_distance(a, X_A, b, X_B);
    if (gap < 1e-3) continue;
    errors.push_back(fcl_distance(a, X_A, b, X_B, kTolerance) - gap);
    EXPECT_LT(errors.back(), kFclError) << "sample " << i << ", gap " << gap;
    EXPECT_GT(errors.back(), -kOurError) << "sample " << i << ", gap " << gap;
  }
  ASSERT_GT(errors.size(), 40u);
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(std::abs(errors[errors.size() / 2]), kOurError);
}

// The expanding polytope algorithm stops within the tolerance of the depth. The default, 1e-6, is
// the smallest for which libccd does not fail its own assertions on spheres.
TEST_P(FclOracle, DepthOfOverlappingShapes) {
  constexpr double kTolerance = 1e-6;
  // With rims and wide polygons libccd's faces lie inside the Minkowski difference by more than its
  // tolerance.
  constexpr double kFclError = 3e-5;
  int overlapping = 0;
  for (int i = 0; overlapping < 20 && i < 200; ++i) {
    const Pose X_A = random_pose(rng, 0.5);
    const Pose X_B{random_rotation(rng), X_A.translation + random_vector(rng, 0.8)};
    const double gap = our_distance(a, X_A, b, X_B);
    // At larger depths the centers are so close that many separating translations are equally long.
    if (gap > -1e-3 || gap < -0.1) continue;
    ++overlapping;
    EXPECT_NEAR(fcl_distance(a, X_A, b, X_B, kTolerance), gap, kFclError) << "sample " << i;
  }
  EXPECT_EQ(overlapping, 20);
}

}  // namespace
}  // namespace counterpoint::test::fcl_oracle_test
