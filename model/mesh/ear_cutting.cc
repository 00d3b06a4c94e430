#include "counterpoint/model/mesh/ear_cutting.h"

#include <cmath>
#include <limits>

namespace counterpoint {
namespace {

using Point = std::array<double, 2>;

/// Axes of the coordinate plane to project to: across the axis that is nearest to the normal of the
/// first bent corner.
std::array<int, 2> projection_axes(const std::vector<Vector3>& vertices,
                                   const std::vector<int>& polygon) {
  const size_t n = polygon.size();
  for (size_t i = 0; i < n; ++i) {
    const Vector3& corner = vertices[polygon[(i + 1) % n]];
    const Vector3 normal =
        (corner - vertices[polygon[i]]).cross(vertices[polygon[(i + 2) % n]] - corner).cwiseAbs();
    if (!(normal.maxCoeff() > std::numeric_limits<float>::epsilon())) continue;
    if (normal.x() > normal.y() && normal.x() > normal.z()) return {1, 2};
    return normal.z() > normal.x() && normal.z() > normal.y() ? std::array{0, 1} : std::array{0, 2};
  }
  return {1, 2};
}

/// Twice the signed area of a triangle.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
}

/// Whether a ray from p along the first axis crosses the triangle's edges an odd number of times.
bool is_inside(const std::array<Point, 3>& triangle, const Point& p) {
  bool inside = false;
  for (size_t i = 0; i < 3; ++i) {
    const Point& a = triangle[i];
    const Point& b = triangle[(i + 2) % 3];
    if ((a[1] > p[1]) == (b[1] > p[1])) continue;
    if (p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1])) inside = !inside;
  }
  return inside;
}

}  // namespace

std::vector<std::array<int, 3>> cut_ears(const std::vector<Vector3>& vertices,
                                         const std::vector<int>& polygon) {
  const std::array<int, 2> axes = projection_axes(vertices, polygon);
  const auto project = [&](int vertex) {
    return Point{vertices[vertex][axes[0]], vertices[vertex][axes[1]]};
  };
  double area = 0.0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point a = project(polygon[i]), b = project(polygon[(i + 1) % polygon.size()]);
    area += a[0] * b[1] - a[1] * b[0];
  }
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> left = polygon;
  size_t start = 0, failures = 0;
  while (left.size() > 3 && failures < left.size()) {
    const size_t n = left.size();
    start %= n;
    const auto corner = [&](size_t k) { return left[(start + k) % n]; };
    const std::array<Point, 3> ear{project(corner(0)), project(corner(1)), project(corner(2))};
    bool is_ear = turn(ear[0], ear[1], ear[2]) * area >= 0.0;
    for (size_t k = 3; is_ear && k < n; ++k) is_ear = !is_inside(ear, project(corner(k)));
    if (is_ear) {
      triangles.push_back({corner(0), corner(1), corner(2)});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>((start + 1) % n));
      failures = 0;
    } else {
      ++start;
      ++failures;
    }
  }
  if (left.size() == 3) triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace counterpoint
