// Known manifolds: resting, stacked, side by side; planes; scales from 1e-3 to 1e3 m.
#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::manifold_test {
namespace {

using collision::pair_contacts;

// Round-off of coordinates of order 1.
constexpr double kRoundOff = 1e-13;
// Gaps within 1e-9 times the size count as equal; sizes here are below 5 m.
constexpr double kSame = 1e-8;

bool has_point(const Manifold& m, const Vector3& p, double tolerance) {
  return std::any_of(m.points.begin(), m.points.begin() + m.size,
                     [&](const ContactPoint& c) { return (c.position - p).norm() < tolerance; });
}

Pose at(double x, double y, double z) { return {Matrix3::Identity(), Vector3(x, y, z)}; }

TEST(Plane, GapIsHeightOfEveryPointAndTheLowestIsThere) {
  std::mt19937 rng(5);
  Manifold m;
  for (const Shape& shape : {sphere_shape(0.3), box_shape({0.1, 0.2, 0.3}), capsule_shape(0.1, 0.4),
                             cylinder_shape(0.2, 0.3), cylinder_shape(0.5, 0.02),
                             prism_shape(5, 0.3, 0.2), prism_shape(60, 0.3, 0.2, 0.9)}) {
    for (int i = 0; i < 200; ++i) {
      const Pose X_P = random_pose(rng);
      const Pose X = random_pose(rng);
      const Vector3 n = X_P.rotation.col(2);
      const double lowest = -support_height(shape, X, -n) - n.dot(X_P.translation);
      pair_contacts(plane_shape(), X_P, shape, X, lowest + 0.1, m);
      ASSERT_GT(m.size, 0);
      for (int k = 0; k < m.size; ++k) {
        const ContactPoint& c = m.points[k];
        EXPECT_EQ(c.normal, n);
        EXPECT_NEAR(level(plane_shape(), X_P, c.position - 0.5 * c.gap * n), 0.0, kRoundOff);
        const Vector3 on_shape = c.position + 0.5 * c.gap * n;
        // The corners of a box and the line of a cylinder lie on its surface; the lowest point of
        // the upper ball of a steep capsule lies inside.
        EXPECT_LE(level(shape, X, on_shape), kRoundOff);
      }
      EXPECT_NEAR(deepest(m).gap, lowest, kRoundOff);
      Manifold turned;
      pair_contacts(shape, X, plane_shape(), X_P, lowest + 0.1, turned);
      ASSERT_EQ(turned.size, m.size);
      for (int k = 0; k < m.size; ++k) {
        EXPECT_EQ(turned.points[k].normal, -n);
        EXPECT_EQ(turned.points[k].position, m.points[k].position);
        EXPECT_EQ(turned.points[k].gap, m.points[k].gap);
      }
      const Pose moved = random_pose(rng, 3.0);
      pair_contacts(plane_shape(), moved * X_P, shape, moved * X, 10.0, turned);
      EXPECT_NEAR(deepest(turned).gap, lowest, 10.0 * kRoundOff);
    }
  }
}

TEST(Plane, RestingShapesStandOnWellSpreadPoints) {
  Manifold m;
  pair_contacts(plane_shape(), Pose{}, box_shape({0.1, 0.2, 0.3}), at(0, 0, 0.3), 0.01, m);
  ASSERT_EQ(m.size, 4);
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.2, 0.2}) EXPECT_TRUE(has_point(m, {x, y, 0}, kRoundOff));
  }
  pair_contacts(plane_shape(), Pose{}, cylinder_shape(0.2, 0.3), at(0, 0, 0.3), 0.01, m);
  ASSERT_EQ(m.size, 4);
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(m.points[k].position.norm(), 0.2, kRoundOff);
    sum += m.points[k].position;
  }
  EXPECT_LT(sum.norm(), kRoundOff);
  const Matrix3 lying = Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitX()).toRotationMatrix();
  pair_contacts(plane_shape(), Pose{}, cylinder_shape(0.2, 0.3), {lying, Vector3(0, 0, 0.2)}, 0.01,
                m);
  ASSERT_EQ(m.size, 2);
  EXPECT_TRUE(has_point(m, {0, 0.3, 0}, kRoundOff));
  EXPECT_TRUE(has_point(m, {0, -0.3, 0}, kRoundOff));
}

TEST(Plane, ManyVerticesAreReducedToEightThatSpan) {
  Manifold m;
  pair_contacts(plane_shape(), Pose{}, prism_shape(64, 1.0, 0.5), at(0, 0, 0.5), 0.01, m);
  ASSERT_EQ(m.size, 8);
  // In every direction a point reaches cos(45 degrees / 2) of the radius, less one corner spacing.
  for (int i = 0; i < 64; ++i) {
    const double angle = i * 0.1;
    double reach = 0.0;
    for (int k = 0; k < 8; ++k) {
      reach =
          std::max(reach, m.points[k].position.dot(Vector3(std::cos(angle), std::sin(angle), 0)));
    }
    EXPECT_GT(reach, 0.85);
  }
}

// Smallest reach of the points over 64 directions.
double least_reach(const Manifold& m) {
  double least = 1e9;
  for (int i = 0; i < 64; ++i) {
    const Vector3 direction(std::cos(i * 0.1), std::sin(i * 0.1), 0);
    double reach = 0.0;
    for (int k = 0; k < m.size; ++k) reach = std::max(reach, m.points[k].position.dot(direction));
    least = std::min(least, reach);
  }
  return least;
}

// A foot of radius 0.1 m with a sole of radius 0.08 m; the bevel between them rises by 1 mm.
TEST(Plane, AHullStandsOnItsSoleNotOnItsBevel) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 24; ++i) {
    const Vector3 out(std::cos(0.2618 * i), std::sin(0.2618 * i), 0.0);
    corners.push_back(0.08 * out);
    corners.push_back(0.1 * out + Vector3(0, 0, 1e-3));
    corners.push_back(0.1 * out + Vector3(0, 0, 0.1));
  }
  const Shape foot = test::hull_shape(corners);
  Manifold m;
  pair_contacts(plane_shape(), Pose{}, foot, Pose{}, {0.01, 0.02}, m);
  EXPECT_GE(m.size, 7);  // the lowest may be one of the seven
  for (int k = 0; k < m.size; ++k) EXPECT_EQ(m.points[k].gap, 0.0);
  EXPECT_GT(least_reach(m), 0.85 * 0.08);  // bound as above
  // Standing on the bevel requires a tilt of 1 mm / 0.02 m.
  pair_contacts(plane_shape(), Pose{}, foot, Pose{}, {0.01, 0.06}, m);
  EXPECT_EQ(deepest(m).gap, 0.0);
  EXPECT_GT(least_reach(m), 0.85 * 0.08);
}

// Tilts a dense hull of radius r about its lowest point by at most `turn`. The lowest vertex is
// below those of the manifold by less than r turn^2: in every direction between two of the seven,
// the supporting vertex is at most r turn / 4 beside one of theirs.
TEST(Plane, AHullTipsOntoItsManifold) {
  std::mt19937 rng(11);
  constexpr double kRadius = 0.1, kTurn = 0.05;
  std::vector<Vector3> points;
  for (int i = 0; i < 500; ++i) points.push_back(kRadius * random_pose(rng).rotation.col(0));
  const Shape ball = test::hull_shape(points);
  const double low = -support_height(ball, Pose{}, -Vector3::UnitZ());
  Manifold m;
  pair_contacts(plane_shape(), Pose{}, ball, at(0, 0, -low), {0.02, kTurn}, m);
  EXPECT_LT(m.size, 8);
  const Vector3 pivot = deepest(m).position;
  for (int i = 0; i < 64; ++i) {
    const Vector3 axis(std::cos(i * 0.1), std::sin(i * 0.1), 0);
    for (const double angle : {0.2 * kTurn, 0.5 * kTurn, kTurn}) {
      const Matrix3 R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      const Pose tipped{R, pivot + R * (Vector3(0, 0, -low) - pivot)};
      const double lowest = -support_height(ball, tipped, -Vector3::UnitZ());
      double known = 1.0;
      for (int k = 0; k < m.size; ++k) {
        const Vector3 vertex = m.points[k].position + 0.5 * m.points[k].gap * Vector3::UnitZ();
        known = std::min(known, (pivot + R * (vertex - pivot)).z());
      }
      EXPECT_LT(known - lowest, kRadius * kTurn * kTurn);
    }
  }
}

// If a manifold has a single vertex of a hull, this stays the lowest for every tilt by the given
// angle, although other vertices are within the margin.
TEST(Plane, AHullThatCannotTipHasOneContact) {
  std::mt19937 rng(12);
  constexpr double kTurn = 0.05, kMargin = 0.05;
  int single = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vector3> points;
    for (int i = 0; i < 12; ++i) points.push_back(0.1 * random_pose(rng).rotation.col(0));
    const Shape hull = test::hull_shape(points);
    Pose X = random_pose(rng);
    X.translation = -support_height(hull, Pose{X.rotation, Vector3::Zero()}, -Vector3::UnitZ()) *
                    -Vector3::UnitZ();
    Manifold m;
    pair_contacts(plane_shape(), Pose{}, hull, X, {kMargin, kTurn}, m);
    ASSERT_GT(m.size, 0);
    if (m.size > 1) continue;
    ++single;
    const Vector3 vertex = m.points[0].position + 0.5 * m.points[0].gap * Vector3::UnitZ();
    for (int i = 0; i < 64; ++i) {
      const Vector3 axis(std::cos(i * 0.1), std::sin(i * 0.1), 0);
      const Matrix3 R = Eigen::AngleAxisd(kTurn, axis).toRotationMatrix();
      const Pose tipped{R * X.rotation, vertex + R * (X.translation - vertex)};
      EXPECT_NEAR(-support_height(hull, tipped, -Vector3::UnitZ()), vertex.z(), kRoundOff);
    }
  }
  EXPECT_GT(single, 100);
  EXPECT_LT(single, 200);
}

// A stack gives the corners of the overlap rectangle for overlap, touching and separation, with any
// slight tilt.
TEST(BoxBox, StackGivesTheOverlapRectangle) {
  std::mt19937 rng(3);
  Manifold m;
  for (const double tilt : {0.0, 1e-15, 1e-12, 1e-9, 1e-6}) {
    for (const double gap : {-1e-3, 0.0, 1e-3}) {
      for (int i = 0; i < 20; ++i) {
        const Vector3 axis = random_unit(rng);
        const Pose X_B{Eigen::AngleAxisd(tilt, axis).toRotationMatrix(),
                       Vector3(0.3, -0.2, 1.0 + gap)};
        pair_contacts(box_shape({0.5, 0.5, 0.5}), Pose{}, box_shape({0.5, 0.5, 0.5}), X_B, 0.01, m);
        ASSERT_EQ(m.size, 4) << tilt << " " << gap;
        const double tolerance = 4 * tilt + 2 * kSame;
        for (const double x : {-0.2, 0.5}) {
          for (const double y : {-0.5, 0.3}) {
            EXPECT_TRUE(has_point(m, {x, y, 0.5 + 0.5 * gap}, tolerance)) << tilt << " " << gap;
          }
        }
        for (int k = 0; k < 4; ++k) {
          EXPECT_NEAR(m.points[k].gap, gap, tolerance);
          EXPECT_NEAR(m.points[k].normal.z(), 1.0, tolerance);
        }
      }
    }
  }
}

// The overlap of two boxes keeps all its corners; a selection among them could flicker.
TEST(BoxBox, QuarterTurnedStackStandsOnTheWholeOctagon) {
  Manifold m;
  const Pose X_B{Eigen::AngleAxisd(0.25 * std::acos(-1.0), Vector3::UnitZ()).toRotationMatrix(),
                 Vector3(0, 0, 1)};
  pair_contacts(box_shape({0.5, 0.5, 0.5}), Pose{}, box_shape({0.5, 0.5, 0.5}), X_B, 0.01, m);
  ASSERT_EQ(m.size, 8);
  // Corners of a regular octagon of inner radius 0.5.
  for (int k = 0; k < 8; ++k) {
    const Vector3 p = m.points[k].position - Vector3(0, 0, 0.5);
    EXPECT_NEAR(p.norm(), 0.5 / std::cos(std::acos(-1.0) / 8.0), kSame);
    EXPECT_NEAR(p.z(), 0.0, kSame);
    for (int l = 0; l < k; ++l)
      EXPECT_GT((m.points[k].position - m.points[l].position).norm(), 0.4);
  }
}

// A manifold with too many corners keeps seven that span the area, and the deepest. A full circle
// on a square keeps four.
TEST(ConvexConvex, ManyCornersAreReducedToThoseThatSpan) {
  Manifold m;
  const Shape table = box_shape({2.0, 2.0, 0.5});
  pair_contacts(table, Pose{}, prism_shape(14, 1.0, 0.5), at(0, 0, 1), 0.01, m);
  ASSERT_GE(m.size, 7);  // plus the deepest, if it is another
  for (int i = 0; i < 64; ++i) {
    const double angle = i * 0.1;
    double reach = 0.0;
    for (int k = 0; k < m.size; ++k) {
      reach =
          std::max(reach, m.points[k].position.dot(Vector3(std::cos(angle), std::sin(angle), 0)));
    }
    // At most two adjacent corners of fourteen are missing: cos(3/2 * 360 / 14 degrees) = 0.78.
    EXPECT_GT(reach, 0.78);
  }
  pair_contacts(table, Pose{}, cylinder_shape(1.0, 0.5), at(0, 0, 1), 0.01, m);
  ASSERT_EQ(m.size, 4);
  for (int k = 0; k < 4; ++k) {
    const Vector3 p = m.points[k].position - Vector3(0, 0, 0.5);
    EXPECT_NEAR(p.norm(), 1.0, kSame);
    EXPECT_NEAR(p.dot(m.points[(k + 1) % 4].position), 0.0, kSame);
  }
}

TEST(BoxBox, CornersEdgesAndFacesGiveTheTrueDistance) {
  Manifold m;
  const Shape cube = box_shape({0.5, 0.5, 0.5});
  pair_contacts(cube, Pose{}, cube, at(1.3, 1.4, 2.2), 10.0, m);
  EXPECT_NEAR(deepest(m).gap, Vector3(0.3, 0.4, 1.2).norm(), kRoundOff);
  pair_contacts(cube, Pose{}, cube, at(0.2, 1.3, 1.4), 10.0, m);
  EXPECT_NEAR(deepest(m).gap, 0.5, kSame);
  pair_contacts(cube, Pose{}, cube, at(0.2, 0.1, 1.25), 10.0, m);
  EXPECT_NEAR(deepest(m).gap, 0.25, kSame);
}

TEST(Capsule, LyingOnABoxOrAlongsideAnotherGivesTwoPoints) {
  Manifold m;
  const Matrix3 lying = Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitY()).toRotationMatrix();
  const Shape capsule = capsule_shape(0.1, 0.5);
  pair_contacts(box_shape({0.3, 0.3, 0.3}), Pose{}, capsule, {lying, Vector3(0.1, 0, 0.4)}, 0.01,
                m);
  ASSERT_EQ(m.size, 2);
  EXPECT_TRUE(has_point(m, {-0.3, 0, 0.3}, kSame));
  EXPECT_TRUE(has_point(m, {0.3, 0, 0.3}, kSame));
  pair_contacts(capsule, Pose{}, capsule, at(0.2, 0, 0.3), 0.01, m);
  ASSERT_EQ(m.size, 2);
  EXPECT_TRUE(has_point(m, {0.1, 0, -0.2}, kRoundOff));
  EXPECT_TRUE(has_point(m, {0.1, 0, 0.5}, kRoundOff));
  pair_contacts(cylinder_shape(0.1, 0.5), Pose{}, cylinder_shape(0.1, 0.5), at(0.201, 0, 0.3), 0.01,
                m);
  ASSERT_EQ(m.size, 2);
  EXPECT_TRUE(has_point(m, {0.1005, 0, -0.2}, 1e-6));
  EXPECT_TRUE(has_point(m, {0.1005, 0, 0.5}, 1e-6));
}

// Distances between centres and axes in closed form.
TEST(ClosedForm, RoundShapes) {
  std::mt19937 rng(11);
  Manifold m;
  for (int i = 0; i < 500; ++i) {
    const Pose X_A = random_pose(rng);
    const Pose X_B = random_pose(rng);
    const Vector3 d = X_B.translation - X_A.translation;
    pair_contacts(sphere_shape(0.2), X_A, sphere_shape(0.3), X_B, 10.0, m);
    ASSERT_EQ(m.size, 1);
    EXPECT_NEAR(m.points[0].gap, d.norm() - 0.5, kRoundOff);
    pair_contacts(sphere_shape(0.2), X_A, capsule_shape(0.3, 0.4), X_B, 10.0, m);
    const double along = std::clamp(-d.dot(X_B.rotation.col(2)), -0.4, 0.4);
    EXPECT_NEAR(m.points[0].gap, (d + along * X_B.rotation.col(2)).norm() - 0.5, kRoundOff);
    // The segments are long enough for the distance between the lines to hold.
    const Vector3 cross = X_A.rotation.col(2).cross(X_B.rotation.col(2));
    if (cross.norm() < 0.1) continue;
    pair_contacts(capsule_shape(0.2, 100.0), X_A, capsule_shape(0.3, 100.0), X_B, 10.0, m);
    EXPECT_NEAR(deepest(m).gap, std::abs(cross.normalized().dot(d)) - 0.5, 1e-6);
  }
}

// Scaling shapes, poses and margin by one factor scales the gaps.
TEST(Scale, ThousandthToThousandMetres) {
  std::mt19937 rng(17);
  const auto shapes = [](double s) {
    std::vector<Shape> all = {sphere_shape(0.4 * s), box_shape(s * Vector3(0.3, 0.5, 0.2)),
                              capsule_shape(0.2 * s, 0.5 * s), cylinder_shape(0.3 * s, 0.4 * s),
                              prism_shape(6, 0.4 * s, 0.3 * s, 0.7)};
    return all;
  };
  Manifold m, n;
  for (const double scale : {1e-3, 1e3}) {
    const std::vector<Shape> unit = shapes(1.0);
    const std::vector<Shape> scaled = shapes(scale);
    for (std::size_t i = 0; i < unit.size(); ++i) {
      for (std::size_t j = 0; j < unit.size(); ++j) {
        for (int k = 0; k < 20; ++k) {
          Pose X_A = random_pose(rng, 0.5);
          Pose X_B = random_pose(rng, 0.5);
          pair_contacts(unit[i], X_A, unit[j], X_B, 10.0, m);
          X_A.translation *= scale;
          X_B.translation *= scale;
          pair_contacts(scaled[i], X_A, scaled[j], X_B, 10.0 * scale, n);
          EXPECT_NEAR(deepest(n).gap / scale, deepest(m).gap, kSame);
        }
      }
    }
  }
}

TEST(Degenerate, ShapesWithoutSizeGiveFiniteContacts) {
  Manifold m;
  const std::vector<Shape> shapes = {sphere_shape(0.0),          box_shape({0, 0, 0}),
                                     box_shape({0.3, 0.3, 0.0}), capsule_shape(0.0, 0.0),
                                     cylinder_shape(0.0, 0.0),   cylinder_shape(0.3, 0.0)};
  for (const Shape& a : shapes) {
    for (const Shape& b : shapes) {
      for (const Vector3& p : {Vector3(0, 0, 0), Vector3(0, 0, 0.1), Vector3(0.3, 0.3, 0.0)}) {
        pair_contacts(a, Pose{}, b, {Matrix3::Identity(), p}, 1.0, m);
        ASSERT_GT(m.size, 0);
        for (int k = 0; k < m.size; ++k) {
          EXPECT_TRUE(m.points[k].position.allFinite());
          EXPECT_NEAR(m.points[k].normal.norm(), 1.0, kRoundOff);
          EXPECT_TRUE(std::isfinite(m.points[k].gap));
        }
      }
    }
  }
}

// A box that overhangs another by half and is tilted very slightly about y stands over an edge, on
// two corners of equal height. Each gap must be the local height and not the lowest height of the
// box, which lies beside the other box. An error of 1e-11 m would disturb a body at rest.
TEST(Manifold, BarelyTiltedBoxesHaveTheGapsOfTheirCorners) {
  const Shape box{ShapeType::kBox, Vector3::Constant(0.1), nullptr};
  constexpr double kSink = 3e-10;
  constexpr double kRound = 1e-16;  // round-off of heights of 0.2 m
  Manifold m;
  for (const double tilt : {-2e-9, -5e-10, -1e-11, 0.0, 1e-12, 1e-10, 5e-10, 7e-10, 2e-9}) {
    const Pose X_B{Eigen::AngleAxisd(tilt, Vector3::UnitY()).toRotationMatrix(),
                   Vector3(0.105, 0.0, 0.2 - kSink)};
    pair_contacts(box, Pose{}, box, X_B, 1e-3, m);
    ASSERT_EQ(m.size, 4);
    for (int i = 0; i < m.size; ++i) {
      const double height = -kSink - tilt * (m.points[i].position.x() - 0.105);
      EXPECT_NEAR(m.points[i].gap, height, kRound) << tilt;
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::manifold_test
