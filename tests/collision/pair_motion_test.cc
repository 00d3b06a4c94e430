// look_ahead: contacts evaluated at the predicted poses; and rounded edges.
#include "counterpoint/collision/pairs/pair_motion.h"

#include <gtest/gtest.h>

#include <numbers>

#include "counterpoint/model/spatial.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::pair_motion_test {
namespace {

using collision::look_ahead;
using collision::PairMotion;
using collision::ShapeMotion;

// Round-off of gaps and positions of a few decimetres.
constexpr double kRoundoff = 1e-13;

// Polygons are clipped slightly beyond their edges, by 2e-10 of the sizes.
constexpr double kClipping = 1e-9;

// Motion of a shape whose frame is its body's; fixed by default.
ShapeMotion motion(const Pose& X, const Motion& displacement = {}, double share = 0.0) {
  return {X, X.translation, displacement, share};
}

Pose at(const Vector3& p) { return {Matrix3::Identity(), p}; }

struct Sliding {
  Shape tile = box_shape({0.5, 0.5, 0.1}), block = box_shape({0.1, 0.1, 0.1});
  Pose X_tile = at({0.5, 0.0, -0.1});  // its top is z = 0 for x > 0
  Pose X_block;
  double margin = 0.01;
  Manifold m;

  // Block with its lower edge `before` the tile's edge and its bottom at `height`, moving by `way`.
  void look(double before, double height, const Vector3& way) {
    X_block = at({-0.1 - before, 0.0, 0.1 + height});
    m.size = 0;
    pair_contacts(tile, X_tile, block, X_block, margin, m);
    const PairMotion pair(motion(X_tile), motion(X_block, {Vector3::Zero(), way}, 1.0),
                          X_block.translation, block.size.norm());
    look_ahead(tile, block, pair, margin, m);
  }
};

// A block that overlaps its floor by 1e-10 m would hit the side of the next tile. Evaluated at its
// predicted pose it is on top of that tile.
TEST(LookAhead, ASeamIsNoObstacle) {
  Sliding s;
  for (const double height : {-1e-10, 0.0, 1e-10}) {
    s.look(1e-3, height, {3e-3, 0.0, 0.0});
    ASSERT_GT(s.m.size, 0);
    for (int i = 0; i < s.m.size; ++i) {
      EXPECT_NEAR((s.m.points[i].normal - Vector3::UnitZ()).norm(), 0.0, kRoundoff);
      EXPECT_NEAR(s.m.points[i].gap, height, kRoundoff);
      // On the block's bottom at the present pose, where the tile will be below it.
      EXPECT_GE(s.m.points[i].position.x(), -3e-3 - kClipping);
      EXPECT_LE(s.m.points[i].position.x(), -1e-3 + kClipping);
    }
  }
}

// A raised tile and a wall are obstacles. A block that does not reach the seam in this step keeps
// the contact with the side.
TEST(LookAhead, AStepIsAnObstacle) {
  Sliding s;
  for (const double height : {-1e-6, -1e-4, -0.05}) {
    s.look(1e-3, height, {3e-3, 0.0, 0.0});
    ASSERT_GT(s.m.size, 0);
    for (int i = 0; i < s.m.size; ++i) {
      EXPECT_NEAR((s.m.points[i].normal + Vector3::UnitX()).norm(), 0.0, kRoundoff);
      EXPECT_NEAR(s.m.points[i].gap, 1e-3, kRoundoff);
    }
  }
  s.look(1e-3, -1e-10, {0.5e-3, 0.0, 0.0});
  ASSERT_GT(s.m.size, 0);
  EXPECT_NEAR((s.m.points[0].normal + Vector3::UnitX()).norm(), 0.0, kRoundoff);
}

// A block that falls past the edge of a table: the nearest direction would stop it in the air.
TEST(LookAhead, WhatPassesACornerIsNotStopped) {
  Sliding s;
  s.look(1e-3, 0.5e-3, {3e-3, 0.0, 0.0});
  for (int i = 0; i < s.m.size; ++i) {
    const collision::ContactPoint& p = s.m.points[i];
    EXPECT_GE(p.gap + p.normal.dot(Vector3(3e-3, 0.0, 0.0)), -kRoundoff);
  }
}

// For translations the gap along a normal is linear, so the returned gap plus the relative motion
// is the gap of the moved shapes. Exchanging A and B gives the same points.
TEST(LookAhead, GapsAreThoseOfTheMovedShapes) {
  std::mt19937 rng(5);
  const std::vector<Shape> shapes = {box_shape({0.1, 0.2, 0.05}), cylinder_shape(0.1, 0.2),
                                     prism_shape(5, 0.1, 0.1), box_shape({0.2, 0.1, 0.1})};
  int replaced = 0;
  for (int k = 0; k < 20000; ++k) {
    const Shape& a = shapes[k % 4];
    const Shape& b = shapes[(k / 4) % 4];
    const Pose X_A = random_pose(rng, 0.1);
    const Pose X_B = random_pose(rng, 0.4);
    const Vector3 way_a = 0.02 * random_unit(rng), way_b = 0.02 * random_unit(rng);
    Manifold start;
    pair_contacts(a, X_A, b, X_B, 0.05, start);
    if (start.size == 0 || start.points[0].gap < 0.0) continue;
    const ShapeMotion of_a = motion(X_A, {Vector3::Zero(), way_a}, 0.3);
    const ShapeMotion of_b = motion(X_B, {Vector3::Zero(), way_b}, 0.7);
    Manifold m = start;
    look_ahead(a, b, PairMotion(of_a, of_b, X_B.translation, 0.2), 0.05, m);
    if (m.size == start.size && m.points[0].normal == start.points[0].normal) continue;
    ++replaced;
    Manifold moved;
    pair_contacts(a, {X_A.rotation, X_A.translation + way_a}, b,
                  {X_B.rotation, X_B.translation + way_b}, 0.05, moved);
    ASSERT_EQ(m.size, moved.size);
    for (int i = 0; i < m.size; ++i) {
      const Vector3& n = m.points[i].normal;
      EXPECT_NEAR(m.points[i].gap + n.dot(way_b - way_a), moved.points[i].gap, kRoundoff);
      EXPECT_GE(m.points[i].gap, -2e-7);  // flush shapes: a millionth of the size
    }
    Manifold turned;
    pair_contacts(b, X_B, a, X_A, 0.05, turned);
    look_ahead(b, a, PairMotion(of_b, of_a, X_B.translation, 0.2), 0.05, turned);
    ASSERT_EQ(turned.size, m.size);
    for (int i = 0; i < m.size; ++i) {
      EXPECT_EQ(turned.points[i].gap, m.points[i].gap);
      EXPECT_EQ((turned.points[i].normal + m.points[i].normal).norm(), 0.0);
      EXPECT_NEAR((turned.points[i].position - m.points[i].position).norm(), 0.0, kRoundoff);
    }
  }
  EXPECT_GT(replaced, 20);
}

// Resting, separating and too large motions leave the manifold unchanged, to the bit.
TEST(LookAhead, ChangesNothingElse) {
  Sliding s;
  for (const Vector3& way : {Vector3(0.0, 0.0, 0.0), Vector3(1e-11, 0.0, 0.0),
                             Vector3(-3e-3, 0.0, 0.0), Vector3(0.1, 0.0, 0.0)}) {
    s.look(1e-3, -1e-10, way);
    Manifold plain;
    pair_contacts(s.tile, s.X_tile, s.block, s.X_block, s.margin, plain);
    ASSERT_EQ(s.m.size, plain.size);
    for (int i = 0; i < plain.size; ++i) {
      EXPECT_EQ(s.m.points[i].gap, plain.points[i].gap);
      EXPECT_EQ(s.m.points[i].position, plain.points[i].position);
      EXPECT_EQ(s.m.points[i].normal, plain.points[i].normal);
    }
  }
}

// Two boxes tilted towards each other by 30 degrees with coincident edges. B is raised by `up` and
// pushed in by `in` along x.
struct Edges {
  static constexpr double kTip = std::numbers::pi / 6.0;
  Shape box = box_shape({0.01, 0.1, 0.2});

  Manifold contacts(double in, double up, double rounding) const {
    const Pose X_A{rotation_from_rpy(0.0, kTip, 0.0), Vector3::Zero()};
    const Vector3 edge = X_A.rotation * Vector3(0.01, 0.0, 0.2);  // its point of largest x
    const Pose X_B{rotation_from_rpy(0.0, -kTip, 0.0), {2.0 * edge.x() - in, 0.0, up}};
    Manifold m;
    pair_contacts(box, X_A, box, X_B, {0.01, 1.0, rounding}, m);
    return m;
  }
};

// Every direction between the two face normals is a valid normal; the rounded one is the mean,
// horizontal. Two points, at the ends of the edge.
TEST(Rounding, EdgesInOneLineMeetInTheMiddle) {
  const Edges edges;
  for (const double in : {1e-12, 1e-10, 1e-8}) {
    const Manifold m = edges.contacts(in, 0.0, 1e-6);
    ASSERT_EQ(m.size, 2);
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR((m.points[i].normal - Vector3::UnitX()).norm(), 0.0, 1e-9);
      EXPECT_NEAR(m.points[i].gap, -in, 1e-16 + 1e-9 * in);
      EXPECT_NEAR(std::abs(m.points[i].position.y()), 0.1, kRoundoff);
    }
    EXPECT_LT(m.points[0].position.y() * m.points[1].position.y(), 0.0);
  }
  // With sharp edges the normal is a face's, 30 degrees off.
  EXPECT_NEAR(edges.contacts(1e-10, 0.0, 0.0).points[0].normal.x(), std::cos(Edges::kTip), 1e-9);
}

// While one edge rises over the other, the normal turns continuously from the mean to that of the
// face met first, by at most the rise over the rounding.
TEST(Rounding, TheNormalTurnsContinuously) {
  const Edges edges;
  constexpr double kRounding = 1e-6, kRise = 1e-8;
  double last = edges.contacts(1e-10, -2e-6, kRounding).points[0].normal.z();
  EXPECT_NEAR(std::abs(last), std::sin(Edges::kTip), 1e-9);
  double least = last, most = last;
  for (double up = -2e-6; up < 2e-6; up += kRise) {
    const double now = edges.contacts(1e-10, up, kRounding).points[0].normal.z();
    EXPECT_LE(std::abs(now - last), 1.001 * kRise / kRounding) << up;
    last = now;
    least = std::min(least, now);
    most = std::max(most, now);
  }
  EXPECT_NEAR(most, std::sin(Edges::kTip), 1e-9);
  EXPECT_NEAR(least, -std::sin(Edges::kTip), 1e-9);
}

// A box that rests with a face on another has the contacts of sharp boxes.
TEST(Rounding, FacesAreNotRounded) {
  std::mt19937 rng(6);
  const Shape below = box_shape({0.5, 0.5, 0.1}), above = box_shape({0.1, 0.1, 0.1});
  for (int k = 0; k < 200; ++k) {
    const Vector3 place = 0.3 * random_unit(rng);
    const Pose X{rotation_from_rpy(0.0, 0.0, 6.0 * place.x()), {place.x(), place.y(), 0.2 - 1e-10}};
    Manifold sharp, rounded;
    pair_contacts(below, Pose{}, above, X, {0.01, 1.0, 0.0}, sharp);
    pair_contacts(below, Pose{}, above, X, {0.01, 1.0, 1e-6}, rounded);
    ASSERT_EQ(sharp.size, rounded.size);
    for (int i = 0; i < sharp.size; ++i) {
      EXPECT_EQ(sharp.points[i].gap, rounded.points[i].gap);
      EXPECT_EQ(sharp.points[i].position, rounded.points[i].position);
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::pair_motion_test
