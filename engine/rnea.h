// Inverse dynamics by the recursive Newton-Euler algorithm (Featherstone 2008, table 5.1).
#pragma once

#include "counterpoint/engine/data.h"

namespace counterpoint {

/// tau = M(q) a - n(q, v) - J' f_external: the joint forces (nv) that give acceleration a (nv)
/// [rad/s^2, m/s^2] to the bodies; what acts on single coordinates (rotor inertia, damping) is the
/// caller's. gravity [m/s^2]. Needs compute_poses and compute_velocities; external wrenches from
/// data.external if data.has_external.
void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, Data& data,
          VectorOut tau);

}  // namespace counterpoint
