// Distance between convex hulls and their concave meshes: known depths, closed and open meshes.
#include "counterpoint/model/mesh/hull_standoff.h"

#include <gtest/gtest.h>

#include "counterpoint/model/mesh/triangle_distance.h"
#include "support/sphere_points.h"
#include "support/temp_folder.h"

namespace counterpoint::hull_standoff_test {
namespace {

// Guaranteed accuracy relative to the hull's diameter.
constexpr double kTolerance = 0.02;

double standoff(const TriangleMesh& mesh, double* tolerance) {
  const auto hull = make_convex_hull(mesh.vertices);
  *tolerance = kTolerance * 2.0 * hull->radius;
  return hull_standoff(*hull, mesh);
}

// The result is the distance of some point of the hull, hence never too large.
void expect_standoff(const TriangleMesh& mesh, double expected) {
  double tolerance = 0.0;
  const double found = standoff(mesh, &tolerance);
  EXPECT_LE(found, expected + 1e-12);
  EXPECT_GE(found, expected - tolerance);
}

/// Adds a rectangle at `origin` with sides u and v, in n by n cells of two triangles.
void add_sheet(const Vector3& origin, const Vector3& u, const Vector3& v, int n,
               TriangleMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) mesh.vertices.push_back(origin + (u * i + v * j) / n);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int k = first + i * (n + 1) + j;
      mesh.triangles.push_back({k, k + n + 1, k + n + 2});
      mesh.triangles.push_back({k, k + n + 2, k + 1});
    }
  }
}

/// A unit cube of sheets; `open`: without its top.
TriangleMesh cube(int cells, bool open) {
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  TriangleMesh mesh;
  add_sheet(Vector3::Zero(), y, x, cells, mesh);
  add_sheet(Vector3::Zero(), x, z, cells, mesh);
  add_sheet(y, z, x, cells, mesh);
  add_sheet(Vector3::Zero(), z, y, cells, mesh);
  add_sheet(x, y, z, cells, mesh);
  if (!open) add_sheet(z, x, y, cells, mesh);
  return mesh;
}

TEST(HullStandoff, ConvexMeshesHaveNone) {
  for (const int cells : {1, 3, 20}) expect_standoff(cube(cells, false), 0.0);
  const auto ball = make_convex_hull(test::sphere_points(500));
  TriangleMesh mesh;
  mesh.vertices = ball->vertices;
  for (const auto& face : ball->faces) {
    for (size_t i = 2; i < face.size(); ++i)
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
  }
  expect_standoff(mesh, 0.0);
}

// The middle of the missing lid is half an edge from the walls, for any mesh resolution.
TEST(HullStandoff, AnOpenBoxLacksItsLid) {
  for (const int cells : {1, 4, 15}) expect_standoff(cube(cells, true), 0.5);
}

TEST(HullStandoff, ACavityInsideIsNotSeen) {
  TriangleMesh mesh = cube(2, false);
  TriangleMesh inner = cube(2, false);
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vector3& p : inner.vertices) {
    mesh.vertices.push_back(Vector3::Constant(0.25) + 0.5 * p);
  }
  for (const auto& t : inner.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  }
  expect_standoff(mesh, 0.0);
}

// Two unit cubes, 3 m apart: the middle of the hull between them is 1.5 m from either.
TEST(HullStandoff, ItGrowsWithTheGapThatIsBridged) {
  TriangleMesh mesh = cube(1, false);
  const TriangleMesh other = mesh;
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vector3& p : other.vertices) mesh.vertices.push_back(p + 4.0 * Vector3::UnitX());
  for (const auto& t : other.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  expect_standoff(mesh, 1.5);
}

// Open meshes are reported as concave, too: the middle of a tray 0.3 m deep is 0.25 m from its
// walls.
TEST(HullStandoff, FilesAreMeasuredWhenRead) {
  test::TempFolder folder;
  const auto file = folder.write("tray.obj",
                                 "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0 0.5 0\n"
                                 "v 0 0 0.3\nv 1 0 0.3\nv 1 0.5 0.3\nv 0 0.5 0.3\n"
                                 "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const auto hull = load_convex_mesh(file);
  EXPECT_EQ(hull->source_volume, 0.0);
  EXPECT_NEAR(hull->standoff, 0.25, kTolerance * 2.0 * hull->radius);
  EXPECT_TRUE(is_visibly_concave(*hull));
  EXPECT_NE(hull_note(*hull).find("concave"), std::string::npos);
  EXPECT_EQ(reduce_hull(hull, 6)->standoff, hull->standoff);
  const auto brick = load_convex_mesh(
      folder.write("brick.obj",
                   "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                   "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n"));
  EXPECT_FALSE(is_visibly_concave(*brick));
  EXPECT_EQ(hull_note(*brick), "");
}

// Two or three corners in one place, or three in a line, in any order. The coordinates are exact.
TEST(TriangleDistance, ATriangleWithoutAreaCountsAsItsEdges) {
  const Vector3 o = Vector3::Zero(), x = 2.0 * Vector3::UnitX(), half = Vector3::UnitX();
  const Vector3 above = half + 3.0 * Vector3::UnitZ(), beyond = 3.0 * Vector3::UnitX();
  for (const Vector3& third : {o, x, half}) {
    std::array<Vector3, 3> corners{o, x, third};
    for (int turn = 0; turn < 3; ++turn) {
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
      for (const bool swapped : {false, true}) {
        const Vector3 &a = corners[0], &b = corners[swapped ? 2 : 1], &c = corners[swapped ? 1 : 2];
        EXPECT_EQ(distance_to_triangle(above, a, b, c), 3.0);
        EXPECT_EQ(distance_to_triangle(beyond, a, b, c), 1.0);
      }
    }
  }
  EXPECT_EQ(distance_to_triangle(beyond, x, x, x), 1.0);
}

}  // namespace
}  // namespace counterpoint::hull_standoff_test
