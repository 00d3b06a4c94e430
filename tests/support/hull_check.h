#pragma once
// Properties of every convex hull.

#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/model/geometry.h"

namespace counterpoint::test {

constexpr double kUnitRoundoff = 1e-13;    // length of a unit normal
constexpr double kRoundoff = 1e-13;        // round-off at size one in double precision
constexpr double kSinglePrecision = 1e-6;  // assimp stores coordinates as floats
constexpr double kMerged = 2e-6;           // merged faces: error over size (make_convex_hull)

/// Expects the properties of every convex polyhedron, with planes accurate to `tolerance` [m].
inline void expect_valid(const ConvexMesh& hull, double tolerance) {
  const size_t edges = hull.vertex_neighbors.all.size();
  EXPECT_EQ(hull.vertex_neighbors.size(), hull.vertices.size());
  EXPECT_EQ(hull.vertices.size() + hull.faces.size(), edges / 2 + 2) << "Euler's formula";
  for (size_t f = 0; f < hull.faces.size(); ++f) {
    EXPECT_NEAR(hull.face_normals[f].norm(), 1.0, kUnitRoundoff);
    for (const Vector3& v : hull.vertices) {
      EXPECT_LT(hull.face_normals[f].dot(v), hull.face_offsets[f] + tolerance);
    }
    const auto& face = hull.faces[f];
    const Vector3 turn = (hull.vertices[face[1]] - hull.vertices[face[0]])
                             .cross(hull.vertices[face[2]] - hull.vertices[face[1]]);
    EXPECT_GT(turn.dot(hull.face_normals[f]), 0.0) << "counter-clockwise from outside";
    EXPECT_LT(hull.face_normals[f].dot(hull.interior_point), hull.face_offsets[f]);
    for (const int v : face) {
      EXPECT_EQ(std::count(hull.vertex_faces[v].begin(), hull.vertex_faces[v].end(), f), 1);
    }
  }
  // At each vertex as many faces meet as edges.
  double radius = 0.0;
  for (size_t v = 0; v < hull.vertices.size(); ++v) {
    EXPECT_EQ(hull.vertex_faces[v].size(), hull.vertex_neighbors[v].size());
    for (const auto& next : hull.vertex_neighbors[v])
      EXPECT_EQ(next.place, hull.vertices[next.vertex]);
    radius = std::max(radius, (hull.vertices[v] - hull.interior_point).norm());
  }
  EXPECT_EQ(hull.radius, radius);
}

}  // namespace counterpoint::test
