// Derivatives of the mean forces of single bodies (free_flight.h).
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/forces/free_flight.h"

namespace counterpoint {

/// Adds to d.dq and d.dv what these forces change by in a step of h [s] from v (nv), beyond being
/// carried along with their bodies: with angular velocity, and with gravity [m/s^2] as a top sees
/// it. By extrapolated differences of these functions of three variables alone.
void add_flight_derivatives(const Model& model, double h, const VectorRef& v,
                            const Vector3& gravity, const FreeFlight& flight, const Kinematics& data,
                            InverseDerivatives& d);  // Parameters: what it depends on, one by one

}  // namespace counterpoint
