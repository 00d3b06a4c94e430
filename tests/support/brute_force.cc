#include "support/brute_force.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace counterpoint::test {
namespace {

// Core of a shape at its pose: corners, edges, and faces with corners counter-clockwise from
// outside.
struct Core {
  std::vector<Vector3> corners;
  std::vector<std::array<int, 2>> edges;
  std::vector<std::vector<int>> faces;
  double radius = 0.0;
};

void add_edges_of_faces(Core& core) {
  for (const std::vector<int>& face : core.faces) {
    for (std::size_t i = 0; i < face.size(); ++i) {
      const int from = face[i];
      const int to = face[(i + 1) % face.size()];
      if (from < to) core.edges.push_back({from, to});
    }
  }
}

Core make_core(const Shape& shape, const Pose& X) {
  Core core;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere:
      core.corners = {X.translation};
      core.edges = {{0, 0}};
      core.radius = s[0];
      break;
    case ShapeType::kCapsule:
      core.corners = {X * Vector3(0, 0, -s[1]), X * Vector3(0, 0, s[1])};
      core.edges = {{0, 1}};
      core.radius = s[0];
      break;
    case ShapeType::kBox:
      for (int i = 0; i < 8; ++i) {
        core.corners.push_back(
            X * Vector3(i & 1 ? s[0] : -s[0], i & 2 ? s[1] : -s[1], i & 4 ? s[2] : -s[2]));
      }
      core.faces = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
      add_edges_of_faces(core);
      break;
    case ShapeType::kConvexMesh:
      for (const Vector3& v : shape.mesh->vertices) core.corners.push_back(X * v);
      core.faces = shape.mesh->faces;
      add_edges_of_faces(core);
      break;
    case ShapeType::kCylinder:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return core;
}

double point_to_segment(const Vector3& p, const Vector3& a, const Vector3& b) {
  const Vector3 d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp(d.dot(p - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * d).norm();
}

double segment_to_segment(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                          const Vector3& b1) {
  const double ends = std::min({point_to_segment(a0, b0, b1), point_to_segment(a1, b0, b1),
                                point_to_segment(b0, a0, a1), point_to_segment(b1, a0, a1)});
  const Vector3 u = a1 - a0;
  const Vector3 v = b1 - b0;
  const Vector3 cross = u.cross(v);
  const double area2 = cross.squaredNorm();
  if (!(area2 > 1e-24 * u.squaredNorm() * v.squaredNorm())) return ends;
  const Vector3 r = b0 - a0;
  const double s = r.cross(v).dot(cross) / area2;
  const double t = r.cross(u).dot(cross) / area2;
  if (s < 0.0 || s > 1.0 || t < 0.0 || t > 1.0) return ends;
  return std::min(ends, std::abs(cross.dot(r)) / std::sqrt(area2));
}

// Returns the least distance of corners of `a` above faces of `b`, infinity if there is none above
// any.
double corners_to_faces(const Core& a, const Core& b) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<int>& face : b.faces) {
    Vector3 normal = Vector3::Zero();
    const Vector3& o = b.corners[face[0]];
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      normal += (b.corners[face[i]] - o).cross(b.corners[face[i + 1]] - o);
    }
    normal.normalize();
    for (const Vector3& p : a.corners) {
      const double height = normal.dot(p - o);
      if (height < 0.0 || height >= least) continue;
      bool over = true;
      for (std::size_t i = 0; i < face.size() && over; ++i) {
        const Vector3& from = b.corners[face[i]];
        const Vector3& to = b.corners[face[(i + 1) % face.size()]];
        over = normal.dot((to - from).cross(p - from)) >= 0.0;
      }
      if (over) least = height;
    }
  }
  return least;
}

}  // namespace

bool has_polytope_core(const Shape& shape) {
  return shape.type != ShapeType::kPlane && shape.type != ShapeType::kCylinder;
}

double brute_force_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  const Core core_a = make_core(a, X_A);
  const Core core_b = make_core(b, X_B);
  const double radius = core_a.radius + core_b.radius;
  double along = -std::numeric_limits<double>::infinity();
  for (const Vector3& n : candidate_normals(a, X_A, b, X_B)) {
    along = std::max(along, distance_along(a, X_A, b, X_B, n));
  }
  // Two spheres, or a sphere and a capsule, have cores without volume, which cannot overlap.
  const bool flat = core_a.faces.empty() && core_b.faces.empty();
  if (!flat && along + radius < 0.0) return along;
  double least = std::min(corners_to_faces(core_a, core_b), corners_to_faces(core_b, core_a));
  for (const auto& [a0, a1] : core_a.edges) {
    for (const auto& [b0, b1] : core_b.edges) {
      least = std::min(least, segment_to_segment(core_a.corners[a0], core_a.corners[a1],
                                                 core_b.corners[b0], core_b.corners[b1]));
    }
  }
  return least - radius;
}

}  // namespace counterpoint::test
