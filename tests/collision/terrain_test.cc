// Triangle meshes: flat ones against the plane, closed convex ones against the hull, seams, thin
// walls.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/pairs/terrain_contacts.h"
#include "counterpoint/model/geometry.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"
#include "support/shapes/solids.h"

namespace counterpoint::test::terrain_test {
namespace {

// Round-off of metres through a few rotations.
constexpr double kRoundoff = 1e-12;
// GJK stops at 1e-13 of the size; edge-face pairs add round-off of their own.
constexpr double kIterated = 1e-9;

Shape terrain_shape(const TriangleMesh& mesh) {
  Shape shape;
  shape.type = ShapeType::kTerrain;
  shape.terrain = make_terrain(mesh);
  return shape;
}

// A square of the plane z = 0 with half length 3 m, in cells x cells pairs of triangles whose inner
// vertices are displaced at random within the plane.
TriangleMesh flat_ground(int cells, std::mt19937& rng) {
  TriangleMesh mesh;
  const double pitch = 6.0 / cells;
  for (int i = 0; i <= cells; ++i) {
    for (int j = 0; j <= cells; ++j) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const Vector3 jitter = random_vector(rng, inner ? 0.25 * pitch : 0.0);
      mesh.vertices.emplace_back(pitch * j - 3.0 + jitter.x(), pitch * i - 3.0 + jitter.y(), 0.0);
    }
  }
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const int k = i * (cells + 1) + j;
      const int above = k + cells + 1;
      mesh.triangles.push_back({k, k + 1, above + 1});
      mesh.triangles.push_back({k, above + 1, above});
    }
  }
  return mesh;
}

TriangleMesh surface_of(const ConvexMesh& hull) {
  TriangleMesh mesh;
  mesh.vertices = hull.vertices;
  for (const std::vector<int>& face : hull.faces) {
    for (std::size_t i = 2; i < face.size(); ++i) {
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
    }
  }
  return mesh;
}

Shape round_hull(int points, std::mt19937& rng) {
  std::vector<Vector3> p;
  for (int i = 0; i < points; ++i) {
    p.push_back(random_unit(rng).cwiseProduct(Vector3(0.4, 0.3, 0.35)));
  }
  return hull_shape(p);
}

std::vector<Shape> bodies(std::mt19937& rng) {
  return {sphere_shape(0.3),        box_shape({0.2, 0.3, 0.15}),    capsule_shape(0.1, 0.4),
          cylinder_shape(0.2, 0.3), prism_shape(6, 0.25, 0.2, 0.7), round_hull(30, rng)};
}

TEST(Terrain, FlatTrianglesAreAPlane) {
  std::mt19937 rng(1);
  const Shape plane = plane_shape();
  for (const int cells : {1, 7, 40}) {
    const Shape ground = terrain_shape(flat_ground(cells, rng));
    for (const Shape& body : bodies(rng)) {
      for (int k = 0; k < 60; ++k) {
        const Pose X_WG = random_pose(rng);
        Pose X_GB{random_rotation(rng), random_vector(rng, 1.0)};
        // From a slight overlap to beyond the margin.
        X_GB.translation.z() = 0.0;
        X_GB.translation.z() =
            std::uniform_real_distribution<double>(-0.005, 0.06)(rng) - lowest_point(body, X_GB);
        const double margin = 0.05;
        Manifold on_plane, on_ground;
        pair_contacts(plane, X_WG, body, X_WG * X_GB, margin, on_plane);
        pair_contacts(ground, X_WG, body, X_WG * X_GB, margin, on_ground);
        ASSERT_EQ(on_ground.size > 0, on_plane.size > 0);
        if (on_plane.size == 0) continue;
        EXPECT_NEAR(deepest(on_ground).gap, deepest(on_plane).gap, kRoundoff);
        for (int i = 0; i < on_ground.size; ++i) {
          EXPECT_GT(on_ground.points[i].normal.dot(X_WG.rotation.col(2)), 1.0 - kRoundoff);
        }
      }
    }
  }
}

TEST(Terrain, StandingShapesHaveThePlanesPoints) {
  // Upright bodies have the number and positions of contact points of a plane, wherever the seams
  // lie.
  std::mt19937 rng(2);
  const Shape ground = terrain_shape(flat_ground(40, rng));
  for (const Shape& body : {box_shape({0.2, 0.3, 0.15}), cylinder_shape(0.2, 0.3),
                            prism_shape(6, 0.25, 0.2), sphere_shape(0.3)}) {
    for (int k = 0; k < 100; ++k) {
      Pose X{Eigen::AngleAxisd(0.1 * k, Vector3::UnitZ()).toRotationMatrix(),
             random_vector(rng, 2.0)};
      X.translation.z() = 0.0;
      X.translation.z() = -lowest_point(body, X);
      Manifold on_plane, on_ground;
      pair_contacts(plane_shape(), Pose{}, body, X, 0.01, on_plane);
      pair_contacts(ground, Pose{}, body, X, 0.01, on_ground);
      ASSERT_EQ(on_ground.size, on_plane.size);
      for (int i = 0; i < on_plane.size; ++i) {
        double nearest = 1.0;
        for (int j = 0; j < on_ground.size; ++j) {
          nearest = std::min(nearest,
                             (on_ground.points[j].position - on_plane.points[i].position).norm());
        }
        EXPECT_LT(nearest, kRoundoff);
      }
    }
  }
}

TEST(Terrain, SurfaceOfAHullIsAsFarAsTheHull) {
  std::mt19937 rng(3);
  int touched = 0;
  for (int h = 0; h < 4; ++h) {
    const Shape hull = h == 0   ? prism_shape(4, 0.4, 0.3)
                       : h == 1 ? prism_shape(7, 0.4, 0.3, 0.4)
                                : round_hull(20 + 60 * (h - 2), rng);
    const Shape surface = terrain_shape(surface_of(*hull.mesh));
    for (const Shape& body : bodies(rng)) {
      for (int k = 0; k < 80; ++k) {
        const Pose X_A = random_pose(rng);
        const Pose X_B{random_rotation(rng), X_A.translation + 0.75 * random_unit(rng)};
        const double margin = 0.3;
        Manifold exact, on_surface;
        pair_contacts(hull, X_A, body, X_B, margin, exact);
        if (exact.size > 0 && deepest(exact).gap < 1e-6)
          continue;  // faces are one-sided, so only separated shapes agree
        pair_contacts(surface, X_A, body, X_B, margin, on_surface);
        ASSERT_EQ(on_surface.size > 0, exact.size > 0) << "hull " << h;
        if (exact.size == 0) continue;
        ++touched;
        EXPECT_NEAR(deepest(on_surface).gap, deepest(exact).gap, kIterated)
            << "hull " << h << ", shape " << static_cast<int>(body.type);
        EXPECT_GT(deepest(on_surface).normal.dot(deepest(exact).normal), 1.0 - 1e-7);
      }
    }
  }
  EXPECT_GT(touched, 500);
}

TEST(Terrain, ExchangedSidesTurnTheNormals) {
  std::mt19937 rng(4);
  const Shape ground = terrain_shape(flat_ground(7, rng));
  const Shape body = box_shape({0.2, 0.3, 0.15});
  const Pose X{random_rotation(rng), Vector3(0.1, 0.2, 0.3)};
  Manifold ab, ba;
  pair_contacts(ground, Pose{}, body, X, 0.5, ab);
  pair_contacts(body, X, ground, Pose{}, 0.5, ba);
  ASSERT_GT(ab.size, 0);
  ASSERT_EQ(ab.size, ba.size);
  for (int i = 0; i < ab.size; ++i) {
    EXPECT_EQ(ab.points[i].position, ba.points[i].position);
    EXPECT_EQ(ab.points[i].normal, Vector3(-ba.points[i].normal));
    EXPECT_EQ(ab.points[i].gap, ba.points[i].gap);
  }
}

// Two slopes of 45 degrees that meet at x = 0: a valley (sign 1) or a ridge (-1).
TriangleMesh fold(double sign) {
  TriangleMesh mesh;
  for (const double x : {-1.0, 0.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) mesh.vertices.emplace_back(x, y, sign * std::abs(x));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
  return mesh;
}

TEST(Terrain, ABallInAValleyTouchesBothSlopes) {
  const Shape valley = terrain_shape(fold(1.0));
  Manifold m;
  pair_contacts(valley, Pose{}, sphere_shape(0.1), {Matrix3::Identity(), {0, 0.2, 0.15}}, 0.02, m);
  ASSERT_EQ(m.size, 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(m.points[i].gap, 0.15 * std::sqrt(0.5) - 0.1, kRoundoff);
    EXPECT_NEAR(m.points[i].normal.z(), std::sqrt(0.5), kRoundoff);
  }
}

TEST(Terrain, ABallOverARidgeTurnsFromSlopeToSlope) {
  const Shape ridge = terrain_shape(fold(-1.0));
  constexpr double kRadius = 0.1;
  Vector3 last = Vector3::Zero();
  for (double angle = -1.2; angle <= 1.2; angle += 0.01) {
    // The centre moves on a circle about the ridge; beyond 45 degrees on each side a slope is
    // nearer.
    const Vector3 center(kRadius * std::sin(angle), 0.3, kRadius * std::cos(angle));
    Manifold m;
    pair_contacts(ridge, Pose{}, sphere_shape(kRadius), {Matrix3::Identity(), center}, 0.01, m);
    const double bent = std::clamp(angle, -std::numbers::pi / 4, std::numbers::pi / 4);
    if (std::abs(angle) < std::numbers::pi / 4) {
      ASSERT_EQ(m.size, 1) << angle;
      EXPECT_NEAR(m.points[0].gap, 0.0, kRoundoff);
      EXPECT_LT((m.points[0].normal - Vector3(std::sin(bent), 0, std::cos(bent))).norm(),
                kIterated);
    }
    if (m.size > 0 && !last.isZero()) {
      EXPECT_LT((m.points[0].normal - last).norm(), 0.011);
    }
    last = m.size > 0 ? m.points[0].normal : Vector3(Vector3::Zero());
  }
}

TEST(Terrain, WhatReachesOverAThinWallIsNotHeldByIt) {
  // Two opposite faces, 2 mm apart and 1 m high, and a rod that leans over them without contact.
  TriangleMesh wall;
  for (const double x : {-0.001, 0.001}) {
    for (const double y : {-2.0, 2.0}) {
      for (const double z : {0.0, 1.0}) wall.vertices.emplace_back(x, y, z);
    }
  }
  wall.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {1, 5, 7}, {1, 7, 3}};
  const Shape shape = terrain_shape(wall);
  EXPECT_LT(shape.terrain->triangles[0].normal.x(), -0.9);
  EXPECT_GT(shape.terrain->triangles[2].normal.x(), 0.9);
  const Shape rod = capsule_shape(0.01, 0.5);
  const Matrix3 tilt = Eigen::AngleAxisd(2.2, Vector3::UnitY()).toRotationMatrix();
  Manifold m;
  pair_contacts(shape, Pose{}, rod, {tilt, {0.0, 0.0, 1.1}}, 0.02, m);
  EXPECT_EQ(m.size, 0);
  // Beside the wall each side pushes outwards; the face of the other side must not act through it.
  for (const double side : {-1.0, 1.0}) {
    pair_contacts(shape, Pose{}, sphere_shape(0.05), {Matrix3::Identity(), {side * 0.05, 0, 0.5}},
                  0.01, m);
    ASSERT_EQ(m.size, 1);
    EXPECT_NEAR(m.points[0].gap, -0.001, kRoundoff);
    EXPECT_NEAR(m.points[0].normal.x(), side, kRoundoff);
  }
}

// Whether a point is inside a closed mesh: the solid angles of its triangles sum to 4 pi (van
// Oosterom and Strackee 1983).
bool is_inside(const TriangleMesh& mesh, const Vector3& p) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p,
                  c = mesh.vertices[t[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2.0 * std::atan2(a.dot(b.cross(c)),
                            la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum > 2.0 * std::numbers::pi;
}

// A body of any size around a thin-walled solid of slender triangles overlaps it only where a point
// of the body is inside: no face holds a body beside or beyond it.
TEST(Terrain, DeepPointsAreInsideTheSolid) {
  constexpr double kDeep = 0.05;         // share of the half thickness (terrain_contacts.h)
  const Vector3 kOff(3e-9, 2e-9, 1e-9);  // points may lie on the surface, to round-off [m]
  std::mt19937 rng(8);
  const TriangleMesh mesh = cup(0.05, 0.1, 0.005, 32);
  const Shape solid = terrain_shape(mesh);
  const std::vector<Shape> shapes = {sphere_shape(0.03),           box_shape({0.03, 0.02, 0.05}),
                                     capsule_shape(0.008, 0.05),   cylinder_shape(0.03, 0.03),
                                     box_shape({0.1, 0.08, 0.01}), box_shape({0.02, 0.4, 0.3})};
  int deep = 0;
  for (const Shape& shape : shapes) {
    const collision::Enclosure around = collision::enclose(shape);
    for (int i = 0; i < 3000; ++i) {
      Pose X;
      X.rotation = random_rotation(rng);
      X.translation = Vector3(0.0, 0.0, 0.05) + random_vector(rng, 0.08 + around.thickness);
      collision::TerrainContacts contacts;
      collision::Manifold found;
      contacts.find(*solid.terrain, Pose(), shape, around, X, 0.02, found);
      for (int k = 0; k < found.size; ++k) {
        const collision::ContactPoint& p = found.points[k];
        if (p.gap > -kDeep * around.thickness) continue;
        ++deep;
        const Vector3 point = p.position + 0.5 * p.gap * p.normal;
        EXPECT_TRUE(is_inside(mesh, point + kOff) || is_inside(mesh, point - kOff))
            << shape_type_name(shape.type, "hull") << " " << i << ", gap " << p.gap;
      }
    }
  }
  EXPECT_GT(deep, 1000);
}

TEST(Terrain, RaysHitTheSurfaceOfAHullWhereTheyHitTheHull) {
  std::mt19937 rng(5);
  const Shape hull = round_hull(60, rng);
  const Shape surface = terrain_shape(surface_of(*hull.mesh));
  int hits = 0;
  for (int k = 0; k < 500; ++k) {
    const Pose X = random_pose(rng);
    const Vector3 origin = X.translation + 2.0 * random_unit(rng);
    const Vector3 aim = X.translation + random_vector(rng, 0.5) - origin;
    const auto expected = collision::cast_ray(hull, X, origin, aim);
    const auto found = collision::cast_ray(surface, X, origin, aim);
    ASSERT_EQ(found.has_value(), expected.has_value());
    if (!found) continue;
    ++hits;
    EXPECT_NEAR(found->distance, expected->distance, kRoundoff);
    EXPECT_LT((found->normal - expected->normal).norm(), kIterated);
  }
  EXPECT_GT(hits, 100);
}

TEST(Terrain, BrokenMeshesNeitherCrashNorGiveNaN) {
  std::mt19937 rng(6);
  std::uniform_int_distribution<int> pick(0, 29);
  for (int k = 0; k < 200; ++k) {
    TriangleMesh mesh;
    for (int i = 0; i < 30; ++i) {
      // Many vertices on one line, many at one place.
      mesh.vertices.push_back(i % 3 == 0   ? Vector3(0.1 * i, 0, 0)
                              : i % 3 == 1 ? Vector3(1, 1, 0)
                                           : random_vector(rng));
    }
    for (int i = 0; i < 60; ++i) mesh.triangles.push_back({pick(rng), pick(rng), pick(rng)});
    mesh.triangles.push_back({2, 5, 8});
    mesh.triangles.push_back({2, 5, 8});
    const Shape shape = terrain_shape(mesh);
    EXPECT_GT(shape.terrain->dropped, 0);
    for (const Shape& body : bodies(rng)) {
      Manifold m;
      pair_contacts(shape, random_pose(rng), body, random_pose(rng), 0.2, m);
      for (int i = 0; i < m.size; ++i) {
        EXPECT_TRUE(m.points[i].position.allFinite());
        EXPECT_NEAR(m.points[i].normal.norm(), 1.0, 1e-9);
        EXPECT_LT(m.points[i].gap, 0.2);
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::test::terrain_test
