// Every pair of shapes: duality certificates, symmetry, rigid motion, continuity, degenerate input.
#include "counterpoint/collision/pairs/pair_contacts.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>

#include "support/random_poses.h"
#include "support/record_largest.h"
#include "support/shape_reference.h"

namespace counterpoint::test::pair_contacts_test {
namespace {

using collision::pair_contacts;

// Round-off of coordinates of order 1 through a few dozen operations, plus 1e-10 of the size (up to
// 4 here), within which gaps count as equal.
constexpr double kGapError = 1e-9;

struct Named {
  std::string name;
  Shape shape;
};

// Built once, since the test names query it hundreds of times.
const std::vector<Named>& solids() {
  static const std::vector<Named> kSolids{
      {"sphere", sphere_shape(0.4)},          {"box", box_shape({0.3, 0.5, 0.2})},
      {"cube", box_shape({0.4, 0.4, 0.4})},   {"capsule", capsule_shape(0.2, 0.5)},
      {"cylinder", cylinder_shape(0.3, 0.4)}, {"disk", cylinder_shape(0.5, 0.05)},
      {"hexagon", prism_shape(6, 0.4, 0.3)},  {"frustum", prism_shape(40, 0.4, 0.3, 0.5)}};
  return kSolids;
}

class Pairs : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const Shape a = solids()[std::get<0>(GetParam())].shape;
  const Shape b = solids()[std::get<1>(GetParam())].shape;
  std::mt19937 rng{1234};
  Manifold m;

  // Draws poses at random distances; about as many pairs overlap as are separated.
  void draw(Pose& X_A, Pose& X_B) {
    X_A = random_pose(rng, 0.5);
    X_B = {random_rotation(rng), X_A.translation + random_vector(rng, 0.8)};
  }
};

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& info) {
  return solids()[std::get<0>(info.param)].name + "_" + solids()[std::get<1>(info.param)].name;
}

INSTANTIATE_TEST_SUITE_P(All, Pairs,
                         ::testing::Combine(::testing::Range(0, 8), ::testing::Range(0, 8)),
                         pair_name);

// Every point lies on both surfaces, gap apart along the unit normal. The smallest gap equals the
// distance along its normal. For separated shapes this proves optimality: the points bound the
// distance from above, the separating planes from below.
TEST_P(Pairs, PointsLieOnBothSurfacesAndLeastGapIsCertified) {
  int contacts = 0;
  RecordLargest error("certified_gap_error_m"), surface_error("surface_error_m");
  for (int i = 0; i < 400; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    pair_contacts(a, X_A, b, X_B, 10.0, m);
    ASSERT_GT(m.size, 0) << "everything is within a margin of 10 m; sample " << i;
    const ContactPoint least = deepest(m);
    EXPECT_LT(std::abs(error(distance_along(a, X_A, b, X_B, least.normal) - least.gap)), kGapError)
        << i;
    pair_contacts(a, X_A, b, X_B, 0.02, m);
    for (int k = 0; k < m.size; ++k) {
      const ContactPoint& p = m.points[k];
      EXPECT_NEAR(p.normal.norm(), 1.0, 1e-14);
      EXPECT_LT(p.gap, 0.02);
      const double on_a = level(a, X_A, p.position - 0.5 * p.gap * p.normal);
      const double on_b = level(b, X_B, p.position + 0.5 * p.gap * p.normal);
      EXPECT_LE(surface_error(std::max({on_a, on_b, 0.0})), kGapError)
          << "sample " << i << " point " << k;
      if (p.gap > least.gap) continue;
      EXPECT_GE(std::min(on_a, on_b), -kGapError) << "sample " << i << " point " << k;
    }
    contacts += m.size > 0;
    EXPECT_EQ(m.size > 0, least.gap < 0.02);
  }
  EXPECT_GT(contacts, 40);
}

// Moving B by its gap along the normal brings the shapes into contact: the new gap is zero along
// the same normal. Holds for separated and overlapping shapes.
TEST_P(Pairs, ShiftedByTheGapTheyTouch) {
  // The direction between coincident points is found by separating the shapes slightly. On rims its
  // error is about 1e-7 rad, with the size as lever arm: measured 6e-8 m in the gap and 4e-7 m
  // along the normal, allowed 1e-6.
  const bool rims = a.type == ShapeType::kCylinder || b.type == ShapeType::kCylinder;
  const double gap_error = rims ? 2e-7 : kGapError;
  const double normal_error = rims ? 1e-6 : kGapError;
  for (int i = 0; i < 100; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    pair_contacts(a, X_A, b, X_B, 10.0, m);
    const ContactPoint before = deepest(m);
    X_B.translation -= before.gap * before.normal;
    pair_contacts(a, X_A, b, X_B, 10.0, m);
    ASSERT_GT(m.size, 0);
    EXPECT_NEAR(deepest(m).gap, 0.0, gap_error) << "sample " << i << ", gap " << before.gap;
    EXPECT_NEAR(distance_along(a, X_A, b, X_B, deepest(m).normal), 0.0, normal_error) << i;
  }
}

// Penetration is the smallest separating translation over all directions.
TEST_P(Pairs, DepthIsLeastTranslation) {
  const int samples = a.mesh && b.mesh ? 2 : 12;
  int overlapping = 0;
  for (int i = 0; i < 4 * samples && overlapping < samples; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    X_B.translation = X_A.translation + 0.7 * (X_B.translation - X_A.translation);
    pair_contacts(a, X_A, b, X_B, 0.0, m);
    if (m.size == 0) continue;
    ++overlapping;
    // PointsLieOnBothSurfacesAndLeastGapIsCertified proves that this translation separates them.
    EXPECT_GE(deepest(m).gap, largest_distance_along(a, X_A, b, X_B) - kGapError) << i;
  }
  EXPECT_GE(overlapping, samples / 2);
}

TEST_P(Pairs, ExchangingTheShapesTurnsTheNormal) {
  Manifold n;
  for (int i = 0; i < 200; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    pair_contacts(a, X_A, b, X_B, 0.1, m);
    pair_contacts(b, X_B, a, X_A, 0.1, n);
    ASSERT_EQ(m.size, n.size);
    for (int k = 0; k < m.size; ++k) {
      EXPECT_EQ(m.points[k].position, n.points[k].position);
      EXPECT_EQ(m.points[k].normal, -n.points[k].normal);
      EXPECT_EQ(m.points[k].gap, n.points[k].gap);
    }
  }
}

TEST_P(Pairs, LeastGapIsInvariantUnderRigidMotion) {
  for (int i = 0; i < 100; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    const Pose X = random_pose(rng, 3.0);
    pair_contacts(a, X_A, b, X_B, 10.0, m);
    const double gap = deepest(m).gap;
    pair_contacts(a, X * X_A, b, X * X_B, 10.0, m);
    EXPECT_NEAR(deepest(m).gap, gap, kGapError);
  }
}

// The signed distance changes by no more than the shapes move.
TEST_P(Pairs, LeastGapIsContinuousAlongAPath) {
  for (int path = 0; path < 3; ++path) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    const Vector3 velocity = random_unit(rng);
    constexpr double kStep = 1e-3;
    double last = 0.0;
    for (int i = 0; i < 500; ++i) {
      pair_contacts(a, X_A, b, X_B, 10.0, m);
      const double gap = deepest(m).gap;
      if (i > 0) {
        EXPECT_LE(std::abs(gap - last), kStep + kGapError);
      }
      last = gap;
      X_B.translation += kStep * velocity;
    }
  }
}

TEST_P(Pairs, SameBitsTwice) {
  Manifold n;
  for (int i = 0; i < 50; ++i) {
    Pose X_A, X_B;
    draw(X_A, X_B);
    pair_contacts(a, X_A, b, X_B, 0.1, m);
    pair_contacts(a, X_A, b, X_B, 0.1, n);
    ASSERT_EQ(m.size, n.size);
    EXPECT_EQ(std::memcmp(&m.points, &n.points, m.size * sizeof(ContactPoint)), 0);
  }
}

TEST_P(Pairs, DegeneratePosesGiveFiniteContacts) {
  const Matrix3 quarter = Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitX()).toRotationMatrix();
  for (const Matrix3& R : {Matrix3(Matrix3::Identity()), quarter}) {
    for (const Vector3& p : {Vector3(0, 0, 0), Vector3(0, 0, 0.5), Vector3(0.6, 0, 0),
                             Vector3(1e-300, 0, 0), Vector3(0.7, 0.9, 0.0)}) {
      const Pose X_A;
      const Pose X_B{R, p};
      pair_contacts(a, X_A, b, X_B, 10.0, m);
      ASSERT_GT(m.size, 0);
      for (int k = 0; k < m.size; ++k) {
        EXPECT_TRUE(m.points[k].position.allFinite());
        EXPECT_NEAR(m.points[k].normal.norm(), 1.0, 1e-14);
        EXPECT_TRUE(std::isfinite(m.points[k].gap));
      }
      const ContactPoint least = deepest(m);
      EXPECT_NEAR(distance_along(a, X_A, b, X_B, least.normal), least.gap, kGapError);
      if (least.gap < 0.0) {
        EXPECT_GE(least.gap, largest_distance_along(a, X_A, b, X_B) - kGapError) << p.transpose();
      }
    }
  }
}

// Non-finite poses are an error of the caller and must not cause a crash.
TEST_P(Pairs, PosesThatAreNotFiniteDoNotCrash) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e300}) {
    for (int i = 0; i < 3; ++i) {
      Pose X_A, X_B;
      draw(X_A, X_B);
      if (i == 0) X_B.translation[0] = bad;
      if (i == 1) X_A.rotation(1, 2) = bad;
      if (i == 2) X_A.translation.setConstant(bad);
      for (const double margin : {0.0, 10.0}) {
        pair_contacts(a, X_A, b, X_B, margin, m);
        EXPECT_LE(m.size, Manifold::kCapacity);
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::pair_contacts_test
