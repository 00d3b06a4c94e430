#include "support/shape_reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/spatial.h"
#include "support/sphere_points.h"

namespace counterpoint::test {

Shape plane_shape() { return {ShapeType::kPlane, Vector3::Zero(), nullptr}; }
Shape sphere_shape(double radius) { return {ShapeType::kSphere, Vector3(radius, 0, 0), nullptr}; }
Shape box_shape(const Vector3& half) { return {ShapeType::kBox, half, nullptr}; }
Shape capsule_shape(double radius, double half_length) {
  return {ShapeType::kCapsule, Vector3(radius, half_length, 0), nullptr};
}
Shape cylinder_shape(double radius, double half_length) {
  return {ShapeType::kCylinder, Vector3(radius, half_length, 0), nullptr};
}

Shape prism_shape(int corners, double radius, double half, double taper) {
  std::vector<Vector3> corner;
  for (const double end : {-1.0, 1.0}) {
    const double r = end < 0.0 ? radius : taper * radius;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / corners;
      corner.emplace_back(r * std::cos(angle), r * std::sin(angle), end * half);
    }
  }
  return hull_shape(corner);
}

Shape hull_shape(const std::vector<Vector3>& points) {
  return {ShapeType::kConvexMesh, Vector3::Zero(), make_convex_hull(points)};
}

double level(const Shape& shape, const Pose& X, const Vector3& point) {
  const Vector3 p = X.inverse() * point;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane:
      return p.z();
    case ShapeType::kSphere:
      return p.norm() - s[0];
    case ShapeType::kBox:
      return (p.cwiseAbs() - s).maxCoeff();
    case ShapeType::kCapsule:
      return (p - Vector3(0, 0, std::clamp(p.z(), -s[1], s[1]))).norm() - s[0];
    case ShapeType::kCylinder:
      return std::max(std::hypot(p.x(), p.y()) - s[0], std::abs(p.z()) - s[1]);
    case ShapeType::kConvexMesh:
    case ShapeType::kTerrain:
      break;
  }
  double result = -1e300;
  for (std::size_t i = 0; i < shape.mesh->faces.size(); ++i) {
    result = std::max(result, shape.mesh->face_normals[i].dot(p) - shape.mesh->face_offsets[i]);
  }
  return result;
}

double support_height(const Shape& shape, const Pose& X, const Vector3& direction) {
  const Vector3 d = X.rotation.transpose() * direction;
  const Vector3& s = shape.size;
  const double base = direction.dot(X.translation);
  switch (shape.type) {
    case ShapeType::kPlane:
      return 1e300;
    case ShapeType::kSphere:
      return base + s[0] * d.norm();
    case ShapeType::kBox:
      return base + d.cwiseAbs().dot(s);
    case ShapeType::kCapsule:
      return base + s[0] * d.norm() + s[1] * std::abs(d.z());
    case ShapeType::kCylinder:
      return base + s[0] * std::hypot(d.x(), d.y()) + s[1] * std::abs(d.z());
    case ShapeType::kConvexMesh:
    case ShapeType::kTerrain:
      break;
  }
  double height = -1e300;
  for (const Vector3& v : shape.mesh->vertices) height = std::max(height, d.dot(v));
  return base + height;
}

double distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B,
                      const Vector3& n) {
  return -support_height(b, X_B, -n) - support_height(a, X_A, n);
}

namespace {

void polytope_parts(const Shape& shape, const Pose& X, std::vector<Vector3>& normals,
                    std::vector<Vector3>& edges) {
  if (shape.type == ShapeType::kBox) {
    for (int i = 0; i < 3; ++i) {
      normals.push_back(X.rotation.col(i));
      edges.push_back(X.rotation.col(i));
    }
  } else if (shape.type == ShapeType::kCapsule) {
    edges.push_back(X.rotation.col(2));
  } else if (shape.type == ShapeType::kConvexMesh) {
    const ConvexMesh& mesh = *shape.mesh;
    for (const Vector3& n : mesh.face_normals) normals.push_back(X.rotation * n);
    for (const std::vector<int>& face : mesh.faces) {
      for (std::size_t i = 0; i < face.size(); ++i) {
        edges.push_back(
            X.rotation *
            (mesh.vertices[face[(i + 1) % face.size()]] - mesh.vertices[face[i]]).normalized());
      }
    }
  }
}

bool smooth(const Shape& s) {
  return s.type == ShapeType::kSphere || s.type == ShapeType::kCapsule ||
         s.type == ShapeType::kCylinder;
}

}  // namespace

std::vector<Vector3> candidate_normals(const Shape& a, const Pose& X_A, const Shape& b,
                                       const Pose& X_B) {
  std::vector<Vector3> normals;
  std::vector<Vector3> edges_a;
  std::vector<Vector3> edges_b;
  polytope_parts(a, X_A, normals, edges_a);
  polytope_parts(b, X_B, normals, edges_b);
  for (const Vector3& p : edges_a) {
    for (const Vector3& q : edges_b) {
      const Vector3 n = p.cross(q);
      if (n.norm() > 1e-6) normals.push_back(n.normalized());
    }
  }
  const std::size_t size = normals.size();
  for (std::size_t i = 0; i < size; ++i) normals.push_back(-normals[i]);
  return normals;
}

double largest_distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  const auto along = [&](const Vector3& n) { return distance_along(a, X_A, b, X_B, n); };
  double best = -1e300;
  for (const Vector3& n : candidate_normals(a, X_A, b, X_B)) best = std::max(best, along(n));
  if (!smooth(a) && !smooth(b)) return best;
  // Pattern search from the best few directions of a golden spiral.
  constexpr int kNet = 500;
  std::vector<std::pair<double, Vector3>> net;
  for (const Vector3& n : sphere_points(kNet)) net.emplace_back(-along(n), n);
  for (const double sign : {-1.0, 1.0}) {
    for (const Pose* X : {&X_A, &X_B}) {
      const Vector3 n = sign * X->rotation.col(2);
      net.emplace_back(-along(n), n);
    }
  }
  std::sort(net.begin(), net.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
  for (int k = 0; k < 5; ++k) {
    Vector3 n = net[k].second;
    double value = along(n);
    for (double step = 0.05; step > 1e-7;) {
      const Matrix3 frame = frame_from_normal(n);
      bool better = false;
      for (int i = 0; i < 8; ++i) {
        const double angle = std::numbers::pi * i / 4.0;
        const Vector3 trial =
            (n + step * (std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1)))
                .normalized();
        const double trial_value = along(trial);
        // Requires more than round-off: on a plateau the search would wander forever.
        if (trial_value > value + 1e-12) {
          value = trial_value;
          n = trial;
          better = true;
        }
      }
      if (!better) step *= 0.5;
    }
    best = std::max(best, value);
  }
  return best;
}

const ContactPoint& deepest(const Manifold& manifold) {
  int best = 0;
  for (int i = 1; i < manifold.size; ++i) {
    if (manifold.points[i].gap < manifold.points[best].gap) best = i;
  }
  return manifold.points[best];
}

}  // namespace counterpoint::test
