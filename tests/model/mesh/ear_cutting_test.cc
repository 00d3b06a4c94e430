#include "counterpoint/model/mesh/ear_cutting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "counterpoint/model/geometry.h"
#include "support/temp_folder.h"

namespace counterpoint::ear_cutting_test {
namespace {

using Triangles = std::vector<std::array<int, 3>>;

/// Area vector of the triangles [m^2].
Vector3 total_area(const std::vector<Vector3>& vertices, const Triangles& triangles) {
  Vector3 sum = Vector3::Zero();
  for (const auto& t : triangles)
    sum += 0.5 * (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
  return sum;
}

TEST(EarCutting, ConvexPolygonIsAFanFromItsFirstCorner) {
  std::vector<Vector3> vertices;
  for (int i = 0; i < 6; ++i)
    vertices.emplace_back(std::cos(i * std::numbers::pi / 3), 0.2,
                          std::sin(i * std::numbers::pi / 3));
  const Triangles expected{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  EXPECT_EQ(cut_ears(vertices, {0, 1, 2, 3, 4, 5}), expected);
}

// An L-shaped polygon that starts at the corner before its reflex one; this corner is not an ear.
TEST(EarCutting, SearchStaysWhereAnEarWasCutAndGoesOnWhereNoneWas) {
  const std::vector<Vector3> vertices{{0, 0, 1}, {2, 0, 1}, {2, 1, 1},
                                      {1, 1, 1}, {1, 2, 1}, {0, 2, 1}};
  const Triangles expected{{3, 4, 5}, {3, 5, 0}, {3, 0, 1}, {2, 3, 1}};
  const Triangles found = cut_ears(vertices, {2, 3, 4, 5, 0, 1});
  EXPECT_EQ(found, expected);
  EXPECT_NEAR(total_area(vertices, found).z(), 3.0, 1e-15);
}

// Star-shaped polygons in any plane and orientation: the triangles have the polygon's area and
// orientation.
TEST(EarCutting, CoversFlatPolygonsWithoutOverlap) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.2, 1.0), any(-1.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    const int corners = 3 + trial % 12;
    Vector3 x(any(random), any(random), any(random)), y(any(random), any(random), any(random));
    x.normalize();
    y = (y - y.dot(x) * x).normalized();
    std::vector<Vector3> vertices;
    std::vector<int> polygon;
    for (int i = 0; i < corners; ++i) {
      const double angle = (trial % 2 ? 2 : -2) * std::numbers::pi * i / corners,
                   radius = uniform(random);
      vertices.push_back(radius * (std::cos(angle) * x + std::sin(angle) * y));
      polygon.push_back(i);
    }
    Triangles fan;  // about the centre, from which the whole polygon is visible
    vertices.push_back(Vector3::Zero());
    for (int i = 0; i < corners; ++i) fan.push_back({corners, i, (i + 1) % corners});
    const Vector3 area = total_area(vertices, fan);
    const Triangles found = cut_ears(vertices, polygon);
    ASSERT_EQ(found.size(), polygon.size() - 2) << trial;
    double sum = 0.0;
    for (const auto& t : found) {
      const Vector3 one = total_area(vertices, {t});
      EXPECT_GE(one.dot(area), 0.0) << trial;
      sum += one.norm();
    }
    EXPECT_NEAR(sum, area.norm(), 1e-14) << trial;  // some dozen round-offs of numbers below one
  }
}

TEST(EarCutting, EndsOnPolygonsThatOverlapThemselves) {
  const std::vector<Vector3> bow{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_LE(cut_ears(bow, {0, 1, 2, 3}).size(), 2u);
  const std::vector<Vector3> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  EXPECT_LE(cut_ears(line, {0, 1, 2, 3}).size(), 2u);
}

// A box of 1 m whose corner 7 is raised by 0.3 m: the bent top adds 0.1 m^3 if its diagonal passes
// through that corner, half as much otherwise.
TEST(EarCutting, BentFacesOfObjFilesAreCutFromTheirFirstCorner) {
  const test::TempFolder folder;
  const std::string box =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1.3\nv 0 1 1\n"
      "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  constexpr double kSinglePrecision = 1e-6;  // precision of assimp's coordinates
  const auto volume = [&](const std::string& top) {
    return enclosed_volume(load_mesh(folder.write("box.obj", box + "f " + top + "\n"),
                                     Vector3::Ones(), PolygonSplit::kEars));
  };
  EXPECT_NEAR(volume("5 6 7 8"), 1.10, kSinglePrecision);
  EXPECT_NEAR(volume("6 7 8 5"), 1.05, kSinglePrecision);
}

}  // namespace
}  // namespace counterpoint::ear_cutting_test
