// Forward dynamics by the articulated-body algorithm (Featherstone 2008, table 7.1), O(bodies).
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Solves (M(q) + diag(diagonal)) a = n(q, v) + tau + J' f_external for the acceleration a (nv)
/// [m/s^2, rad/s^2]. diagonal (nv) holds the inertia of single coordinates: rotor inertia, and h D
/// of implicit damping. Requires compute_poses, compute_velocities and compute_inertias; external
/// wrenches are data.external if data.has_external. `bodies` must be whole trees; other coordinates
/// of a are not changed. Returns false, and the body in `singular_body` if given, if the inertia
/// that a joint moves is not positive.
bool aba(const Model& model, const VectorRef& tau, const VectorRef& diagonal,
         const Vector3& gravity, BodyRange bodies, Data& data, VectorOut a,
         int* singular_body = nullptr);  // Parameters: independent of one another

}  // namespace counterpoint
