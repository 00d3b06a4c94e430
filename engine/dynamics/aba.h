// Forward dynamics by the articulated-body algorithm (Featherstone 2008, table 7.1), O(bodies).
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Solves (M(q) + diag(diagonal)) a = n(q, v) + tau + J' f_external for the acceleration a (nv);
/// diagonal (nv) holds what acts on single coordinates: rotor inertia, h D of implicit damping.
/// Needs compute_poses, compute_velocities, compute_inertias; velocity-dependent forces
/// and external wrenches are those of `bodies`. `range` must be whole trees; the other coordinates
/// of a are left alone, so that several threads may work on ranges of their own. Returns false,
/// with the body in `singular_body` if given, where the inertia seen by a joint is not positive.
bool aba(const Model& model, const VectorRef& tau, const VectorRef& diagonal,
         const Vector3& gravity, BodyRange range, const BodyState& bodies, VectorOut a,
         int* singular_body = nullptr);

}  // namespace counterpoint
