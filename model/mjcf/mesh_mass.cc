#include "counterpoint/model/mjcf/assets.h"

namespace counterpoint::mjcf {
namespace {

/// The mean of the surface.
Vector3 surface_center(const TriangleMesh& mesh) {
  Vector3 sum = Vector3::Zero();
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double twice = (b - a).cross(c - a).norm();
    sum += twice * (a + b + c) / 3.0;
    area += twice;
  }
  return area > 0.0 ? Vector3(sum / area) : Vector3(Vector3::Zero());
}

}  // namespace

MassProperties mass_properties(const TriangleMesh& mesh, MeshInertia kind) {
  const Vector3 origin = surface_center(mesh);
  MassProperties out;
  Vector3 first = Vector3::Zero();
  Matrix3 second = Matrix3::Zero();
  for (const auto& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
                  c = mesh.vertices[t[2]] - origin, sum = a + b + c;
    const Matrix3 squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
    if (kind == MeshInertia::kShell) {
      // Of a triangle: integral of x x' = area / 12 (aa' + bb' + cc' + ss').
      const double area = 0.5 * (b - a).cross(c - a).norm();
      out.mass += area;
      first += area * sum / 3.0;
      second += area / 12.0 * (squares + sum * sum.transpose());
      continue;
    }
    // Of a tetrahedron with a corner at the origin: volume / 20 (aa' + bb' + cc' + ss').
    double volume = a.dot(b.cross(c)) / 6.0;
    if (kind == MeshInertia::kLegacy) volume = std::abs(volume);
    out.mass += volume;
    first += volume * sum / 4.0;
    second += volume / 20.0 * (squares + sum * sum.transpose());
  }
  // Some files have all triangles inside out.
  if (out.mass < 0.0) {
    out.mass = -out.mass;
    first = -first;
    second = -second;
  }
  if (!(out.mass > 0.0)) return out;
  const Vector3 center = first / out.mass;
  second -= out.mass * center * center.transpose();
  out.center = origin + center;
  out.rotational = second.trace() * Matrix3::Identity() - second;
  return out;
}

}  // namespace counterpoint::mjcf
