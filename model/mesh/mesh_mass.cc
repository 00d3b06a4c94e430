#include "counterpoint/model/mesh/mesh_mass.h"

namespace counterpoint {
namespace {

/// Centroid of the surface [m].
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

/// Integrals over the tetrahedra from an origin to the triangles, or for a shell over the
/// triangles.
struct Moments {
  double zeroth = 0.0;
  Vector3 first = Vector3::Zero();
  Matrix3 second = Matrix3::Zero();  // integral of x x'
};
Moments moments_about(const TriangleMesh& mesh, MeshInertia kind, const Vector3& origin) {
  Moments out;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
                  c = mesh.vertices[t[2]] - origin, sum = a + b + c;
    const Matrix3 squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
    if (kind == MeshInertia::kShell) {
      // A triangle has the second moment area / 12 (aa' + bb' + cc' + ss'), s = a + b + c.
      const double area = 0.5 * (b - a).cross(c - a).norm();
      out.zeroth += area;
      out.first += area * sum / 3.0;
      out.second += area / 12.0 * (squares + sum * sum.transpose());
      continue;
    }
    // A tetrahedron with a corner at the origin has volume / 20 (aa' + bb' + cc' + ss').
    double volume = a.dot(b.cross(c)) / 6.0;
    if (kind == MeshInertia::kLegacy) volume = std::abs(volume);
    out.zeroth += volume;
    out.first += volume * sum / 4.0;
    out.second += volume / 20.0 * (squares + sum * sum.transpose());
  }
  // In some files all triangles face inwards.
  if (out.zeroth < 0.0) out = {-out.zeroth, -out.first, -out.second};
  return out;
}

}  // namespace

MassProperties mass_properties(const TriangleMesh& mesh, MeshInertia kind) {
  MassProperties out;
  const Vector3 origin = surface_center(mesh);
  const Moments from_surface = moments_about(mesh, kind, origin);
  if (!(from_surface.zeroth > 0.0)) return out;
  out.center = origin + from_surface.first / from_surface.zeroth;
  // Unsigned volumes (kLegacy) depend on the origin: MuJoCo uses the centre of mass found above.
  const Moments about_center = moments_about(mesh, kind, out.center);
  out.mass = about_center.zeroth;
  out.rotational = about_center.second.trace() * Matrix3::Identity() - about_center.second;
  return out;
}

}  // namespace counterpoint
