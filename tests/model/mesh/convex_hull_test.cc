// Convex hulls of known solids and of noisy points, and point sets without a hull.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/geometry.h"
#include "support/hull_check.h"
#include "support/random_model.h"

namespace counterpoint::convex_hull_test {
namespace {

using test::expect_valid;
using test::kMerged;
using test::kRoundoff;
using test::kSinglePrecision;

std::vector<Vector3> cube_points(double half) {
  std::vector<Vector3> points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1 ? half : -half), (i & 2 ? half : -half), (i & 4 ? half : -half));
  }
  return points;
}

TEST(ConvexHull, CubeWithDuplicateCoplanarAndInnerPoints) {
  std::vector<Vector3> points = cube_points(0.5);
  for (const Vector3& p : cube_points(0.5)) points.push_back(p);
  for (double x : {-0.25, 0.0, 0.25}) {
    points.emplace_back(x, 0.1, 0.5);   // on a face
    points.emplace_back(x, 0.5, 0.5);   // on an edge
    points.emplace_back(0.1, x, -0.2);  // inside
  }
  const auto hull = make_convex_hull(points);
  EXPECT_EQ(hull->vertices.size(), 8u);
  EXPECT_EQ(hull->faces.size(), 6u);
  EXPECT_NEAR(hull->volume, 1.0, kRoundoff);
  for (const auto& face : hull->faces) EXPECT_EQ(face.size(), 4u);
  for (size_t v = 0; v < 8; ++v) EXPECT_EQ(hull->vertex_neighbors[v].size(), 3u);
  expect_valid(*hull, kRoundoff);
}

TEST(ConvexHull, MergesFacesDespiteSinglePrecisionNoise) {
  // A rotated, translated cube with faces subdivided 10 x 10, rounded to single precision, still
  // has eight corners.
  test::Random random(7);
  for (double size : {1e-3, 1.0, 1e3}) {
    const Pose X = {random.quaternion().toRotationMatrix(), size * random.vector(1.0)};
    std::vector<Vector3> points;
    for (int i = 0; i <= 10; ++i) {
      for (int j = 0; j <= 10; ++j) {
        for (int axis = 0; axis < 3; ++axis) {
          for (double side : {-0.5, 0.5}) {
            Vector3 p;
            p[axis] = side;
            p[(axis + 1) % 3] = 0.1 * i - 0.5;
            p[(axis + 2) % 3] = 0.1 * j - 0.5;
            points.push_back((X * (size * p)).cast<float>().cast<double>());
          }
        }
      }
    }
    const auto hull = make_convex_hull(points);
    EXPECT_EQ(hull->faces.size(), 6u) << "size " << size;
    EXPECT_NEAR(hull->volume / (size * size * size), 1.0, kSinglePrecision);
    expect_valid(*hull, kMerged * std::sqrt(3.0) * size);
  }
}

TEST(ConvexHull, RandomPointsOnASphere) {
  test::Random random(11);
  std::vector<Vector3> points;
  for (int i = 0; i < 2000; ++i) points.push_back(random.unit_vector());
  const auto hull = make_convex_hull(points);
  EXPECT_EQ(hull->vertices.size(), points.size());
  expect_valid(*hull, kMerged * 2 * std::sqrt(3.0));
  const double sphere = 4.0 / 3.0 * std::numbers::pi;
  EXPECT_LT(hull->volume, sphere);
  EXPECT_GT(hull->volume, 0.99 * sphere);
  EXPECT_EQ(make_convex_hull(points)->faces, hull->faces);
}

TEST(ConvexHull, RefusesFlatInput) {
  const std::vector<Vector3> square = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.5, 0.5, 0}};
  EXPECT_THROW(make_convex_hull(square), InputError);
  EXPECT_THROW(make_convex_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), InputError);
  EXPECT_THROW(make_convex_hull(std::vector<Vector3>(8, Vector3(1, 2, 3))), InputError);
  try {
    make_convex_hull(square, "plate.stl");
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("plate.stl"), std::string::npos);
  }
}

}  // namespace
}  // namespace counterpoint::convex_hull_test
