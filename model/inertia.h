// Checks of inertia: is it that of a real body, and does every joint of a tree move some?
#pragma once

#include <string>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// Why no rigid body can have this inertia, or "" if one can: principal moments must be positive
/// and none larger than the sum of the other two (relative tolerance 1e-6, for files printed to few
/// digits). A point mass (all moments zero) and a massless link (all zero) are let pass.
std::string inertia_defect(const SpatialInertia& inertia);

/// Principal moments of an inertia, ascending [kg m^2], and axes, in columns, right-handed.
struct PrincipalAxes {
  Vector3 moments;
  Matrix3 axes;
};
PrincipalAxes principal_axes(const Matrix3& inertia);

/// A near inertia with the same mass, centre and principal axes whose principal moments are
/// those of a body: negative moments are raised to 1/1000 of the largest, then the triangle
/// inequality is met by the least change (Frobenius norm) of the moments.
SpatialInertia nearest_physical(const SpatialInertia& inertia);

/// Inertia of a solid of uniform density about its centre: sphere, box, cylinder or capsule of the
/// given mass [kg].
SpatialInertia solid_inertia(const Shape& shape, double mass);

/// Joint-space inertia matrix M [kg, kg m, kg m^2] of one tree at q (nq, all trees), with armature.
/// A plain reference: composite inertias in one common frame, dense. `scale`, if given, receives
/// for each coordinate the size of the terms that its diagonal entry was summed from.
MatrixX reference_mass_matrix(const Model& model, int tree, const VectorX& q,
                              VectorX* scale = nullptr);

/// The coordinate (0 ... nv of the tree - 1) at which elimination of M from the leaves meets a
/// pivot that is not positive, or -1 if M is positive definite at q. The pivot is the inertia felt
/// at that joint with all later joints free.
int find_coordinate_without_inertia(const Model& model, int tree, const VectorX& q);

}  // namespace counterpoint
