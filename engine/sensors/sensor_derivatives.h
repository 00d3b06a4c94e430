// Derivatives of the values of sensors by the state at the start of a step and the applied force.
#pragma once

#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

/// Derivatives of the values in a forward step (rows, as SensorTable::evaluate has them) by
/// displacements of q, by v, and by the applied force (columns, nv each), the other two held; in
/// the units of the columns per m, rad, m/s, rad/s, N, N m.
struct SensorDerivatives {
  MatrixX dq, dv, du;
};

/// Computes them for the step from `state` under `input` by central differences of whole steps,
/// extrapolated from two lengths (Richardson), in 12 nv steps: a value is a function of the motion,
/// which follows the contacts, so that closed forms by q, v and v_next would cancel to nothing at
/// hard contacts. Errors are about 1e-9 of the largest entry without contacts and limits, and 1e-5
/// with them. A value jumps where a contact starts within a difference, a ray leaves a shape, or
/// the sign of a quaternion turns. NaN where the value is, or a step fails.
/// @throws InputError as step_forward and SensorTable::evaluate.
void sensor_derivatives(const Model& model, const SimulationOptions& options, const State& state,
                        const Input& input, Workspace& workspace, SensorTable& table,
                        SensorDerivatives& d);

}  // namespace counterpoint
