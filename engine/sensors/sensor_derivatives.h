// Derivatives of the values of sensors by the arguments of a step, and by its start and input.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/sensors/sensor_table.h"

namespace counterpoint {

/// Derivatives of SensorTable::evaluate (rows) by displacements of q, by v and by v_next (columns,
/// nv each), the other arguments held; in the units of the columns per m, rad, m/s, rad/s.
struct SensorDerivatives {
  MatrixX dq, dv, dv_next;
};

/// Computes them by central differences at two steps, extrapolated (Richardson): error O(step^4),
/// about 1e-9 of the largest entry of a row, in 12 nv evaluations. A value jumps where a contact
/// starts within a difference, a ray leaves a shape, or the sign of a quaternion turns. NaN where
/// the value is. `step.q_next` is not used: it follows from the other arguments.
/// @throws InputError as SensorTable::evaluate.
void sensor_derivatives(const Model& model, const SimulationOptions& options,
                        const SensorStep& step, SensorTable& table, SensorDerivatives& d);

/// Derivatives by the state at the start and the applied force u of a forward step (rows, nv each).
struct SensorResponse {
  MatrixX dq, dv, du;
};

/// Applies the chain rule: a value that depends on (q, v, v_next) with v_next(q, v, u).
SensorResponse sensor_response(const SensorDerivatives& sensors, const ForwardDerivatives& step);

}  // namespace counterpoint
