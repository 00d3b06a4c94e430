// Gaps and normals along smooth paths.
//
// The witness vector of separated convex shapes, gap times normal, is the point of their Minkowski
// difference closest to the origin. Moving B moves the difference, and projection onto a convex set
// is non-expansive, so the vector changes by no more than B moved. This bounds gap and normal at
// once.
#include <gtest/gtest.h>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/spatial.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::continuity_test {
namespace {

using collision::pair_contacts;

struct Named {
  std::string name;
  Shape shape;
  double radius;  // radius of the ball swept over the core [m]
};

// Built once, since the test names query it hundreds of times.
const std::vector<Named>& solids() {
  static const std::vector<Named> kSolids{{"sphere", sphere_shape(0.4), 0.4},
                                          {"box", box_shape({0.3, 0.5, 0.2}), 0.0},
                                          {"capsule", capsule_shape(0.2, 0.5), 0.2},
                                          {"cylinder", cylinder_shape(0.3, 0.4), 0.0},
                                          {"disk", cylinder_shape(0.5, 0.05), 0.0},
                                          {"hexagon", prism_shape(6, 0.4, 0.3), 0.0},
                                          {"frustum", prism_shape(40, 0.4, 0.3, 0.5), 0.0}};
  return kSolids;
}

class Paths : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const Named a = solids()[std::get<0>(GetParam())];
  const Named b = solids()[std::get<1>(GetParam())];
  std::mt19937 rng{77};

  ContactPoint witness(const Pose& X_A, const Pose& X_B) {
    Manifold m;
    pair_contacts(a.shape, X_A, b.shape, X_B, 100.0, m);
    return deepest(m);
  }
  // Witness vector of the cores; the rounding radius does not change its direction.
  Vector3 witness_vector(const ContactPoint& c) const {
    return (c.gap + a.radius + b.radius) * c.normal;
  }
};

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& info) {
  return solids()[std::get<0>(info.param)].name + "_" + solids()[std::get<1>(info.param)].name;
}

INSTANTIATE_TEST_SUITE_P(All, Paths,
                         ::testing::Combine(::testing::Range(0, 7), ::testing::Range(0, 7)),
                         pair_name);

// Gaps count as equal within 1e-10 of the size. A normal has the error 1e-16 over the core
// distance, or 1e-8 from an iterative solution (square root of the distance's round-off), times up
// to 2 m.
constexpr double kVectorError = 5e-8;

TEST_P(Paths, WitnessVectorMovesNoMoreThanTheBody) {
  constexpr double kStep = 2e-3;
  int steps = 0;
  for (int path = 0; path < 6; ++path) {
    const Pose X_A = random_pose(rng, 0.3);
    // Moves past A, at times through its side.
    const Vector3 way = random_unit(rng);
    const Vector3 aside = frame_from_normal(way).col(0) * (0.6 + 0.2 * path);
    Pose X_B{random_rotation(rng), X_A.translation + aside - 0.8 * way};
    Vector3 last = Vector3::Zero();
    for (int i = 0; i < 800; ++i) {
      const ContactPoint c = witness(X_A, X_B);
      const bool separated = c.gap > 0.0;
      const Vector3 vector = witness_vector(c);
      if (separated && !last.isZero()) {
        EXPECT_LE((vector - last).norm(), kStep + kVectorError) << "path " << path << " step " << i;
        ++steps;
      }
      last = separated ? vector : Vector3::Zero();
      X_B.translation += kStep * way;
    }
  }
  EXPECT_GT(steps, 1000);
}

// A motion that moves no point of B farther than `moved` shifts the support function of the
// Minkowski difference by at most `moved`, and so the signed distance, overlapping or not. The
// nearest points of two convex sets within `moved` of each other are within sqrt(2 moved (d1 + d2))
// (a Hoelder bound, from the parallelogram law).
TEST_P(Paths, GapAndVectorFollowATumblingBody) {
  constexpr double kAngle = 1e-3;
  const double reach = b.shape.mesh ? 0.6 : b.shape.size.norm();
  constexpr double kStep = 1e-3;
  for (int path = 0; path < 4; ++path) {
    const Pose X_A = random_pose(rng, 0.3);
    Pose X_B{random_rotation(rng), X_A.translation + random_unit(rng) * (0.4 + 0.3 * path)};
    const Vector3 spin = kAngle * random_unit(rng);
    const Vector3 velocity = kStep * random_unit(rng);
    const double moved = kAngle * reach + kStep;
    double last_gap = 0.0;
    Vector3 last = Vector3::Zero();
    for (int i = 0; i < 500; ++i) {
      const ContactPoint c = witness(X_A, X_B);
      const Vector3 vector = witness_vector(c);
      if (i > 0) {
        EXPECT_LE(std::abs(c.gap - last_gap), moved + kVectorError)
            << "path " << path << " step " << i;
        if (c.gap > 0.0 && last_gap > 0.0) {
          EXPECT_LE((vector - last).squaredNorm(),
                    2.0 * moved * (vector.norm() + last.norm()) + moved * moved)
              << "path " << path << " step " << i;
        }
      }
      last_gap = c.gap;
      last = vector;
      X_B.rotation = quaternion_exp(spin).toRotationMatrix() * X_B.rotation;
      X_B.translation += velocity;
    }
  }
}

// A resting contact keeps the number, order and positions of its points while the upper body is
// displaced by less than a micrometre at a time.
TEST(Manifold, PointsOfARestingBodyKeepTheirOrderAndPlace) {
  std::mt19937 rng(4);
  const Shape ground = box_shape({2.0, 2.0, 0.5});
  for (const Named& n : solids()) {
    if (n.shape.type == ShapeType::kSphere) continue;
    SCOPED_TRACE(n.name);
    const bool lying = n.shape.type == ShapeType::kCapsule;
    const Matrix3 R = lying ? Matrix3(Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitX()))
                            : Matrix3(Matrix3::Identity());
    const double height = support_height(n.shape, {R, Vector3::Zero()}, -Vector3::UnitZ());
    const auto pose = [&](const Vector3& turn, const Vector3& move) {
      return Pose{quaternion_exp(turn).toRotationMatrix() * R,
                  Vector3(0.1, 0.2, 0.5 + height) + move};
    };
    for (const Shape& below : {ground, plane_shape()}) {
      const Pose X_ground{Matrix3::Identity(),
                          Vector3(0, 0, below.type == ShapeType::kPlane ? 0.5 : 0)};
      Manifold first;
      pair_contacts(below, X_ground, n.shape, pose(Vector3::Zero(), Vector3::Zero()), 0.01, first);
      ASSERT_GE(first.size, lying ? 2 : 3);
      for (int i = 0; i < 300; ++i) {
        constexpr double kMove = 1e-7;
        Manifold m;
        pair_contacts(below, X_ground, n.shape,
                      pose(random_vector(rng, kMove), random_vector(rng, kMove)), 0.01, m);
        // From more than eight corners seven are chosen by position; the deepest joins them.
        const int stable = n.name == "frustum" ? 7 : first.size;
        ASSERT_GE(m.size, stable);
        ASSERT_LE(m.size, first.size + (n.name == "frustum"));
        for (int k = 0; k < m.size; ++k) {
          EXPECT_NEAR(m.points[k].gap, 0.0, 10.0 * kMove);
          // A rim has no corners, so its points rotate with the tilt.
          if (n.shape.type == ShapeType::kCylinder || k >= stable) continue;
          EXPECT_LT((m.points[k].position - first.points[k].position).norm(), 10.0 * kMove);
        }
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::continuity_test
