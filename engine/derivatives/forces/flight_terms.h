// Derivatives of the mean forces of single bodies (free_flight.h).
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/forces/free_flight.h"

namespace counterpoint {

/// Adds to d.dq and d.dv the derivatives of these forces in a step of h [s] from v (nv), beyond
/// being carried along with their bodies: by the angular velocity, and by gravity [m/s^2] in axes
/// of a top on a ball joint. Uses extrapolated differences of mean_force alone, a function of three
/// variables each.
void add_flight_derivatives(const Model& model, double h, const VectorRef& v,
                            const Vector3& gravity, const FreeFlight& flight,
                            const Kinematics& data, InverseDerivatives& d);

}  // namespace counterpoint
