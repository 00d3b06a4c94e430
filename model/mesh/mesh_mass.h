// Mass properties of the solid or the shell that a mesh describes.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// Mass properties of a solid or shell of density 1.
struct MassProperties {
  double mass = 0.0;                     ///< volume [m^3]; area [m^2] for a shell
  Vector3 center = Vector3::Zero();      ///< centre of mass [m]
  Matrix3 rotational = Matrix3::Zero();  ///< about the centre of mass [m^5]; [m^4] for a shell
};

/// How the inertia of a mesh is computed. kExact: from the signed volumes of the tetrahedra between
/// the triangles and the centre. kLegacy, MuJoCo's default: all volumes count as positive. kConvex:
/// kExact for the convex hull. kShell: the mass lies in the surface.
enum class MeshInertia { kLegacy, kExact, kConvex, kShell };
/// Mass properties of a solid ellipsoid about its axes.
/// @param radii  [m]
inline MassProperties ellipsoid_mass(const Vector3& radii) {
  const double volume = 4.0 / 3.0 * EIGEN_PI * radii.prod();
  const Vector3 squares = radii.cwiseAbs2();
  const Vector3 moments = volume / 5.0 * (Vector3::Constant(squares.sum()) - squares);
  return {volume, Vector3::Zero(), moments.asDiagonal()};
}

/// `kind`: kConvex is treated as kExact; the caller passes the triangles of the hull.
MassProperties mass_properties(const TriangleMesh& mesh, MeshInertia kind);

}  // namespace counterpoint
