// The forces of a step, in the order in which they are gathered, and the velocity that they alone
// lead to.
#pragma once

#include <span>

#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Wrenches on bodies at their poses in ws.data, into data.external.
void set_external(const std::vector<ExternalWrench>& wrenches, EffectSet effects,
                  Workspace::Impl& ws);

/// How fast the forces of the step to `next` turn its taut links (taut_links.h). After the step;
/// uses up ws.data but for the poses at its start.
void find_taut_rates(const StepArguments& step, const State& next, Workspace::Impl& ws);

/// h C of all drag (drag.h), with data.external ready for its forces. False if there is none.
bool set_drag(const Model& model, EffectSet effects, double h, Workspace::Impl& ws);

/// Velocity-dependent forces and gravity as far as they are on; returns gravity [m/s^2]. Before any
/// dynamics, after everything that needs the accelerations at constant joint velocities as they
/// are.
Vector3 set_body_forces(const Model& model, EffectSet effects, Workspace::Impl& ws);

/// What rotors add to the diagonal of M (nv), as far as they are on.
const VectorX& rotor_inertia(const Model& model, EffectSet effects, const Workspace::Impl& ws);

/// Kinematics at (q, w) of all bodies, and what acts on them there and then: wrenches, gravity,
/// velocity-dependent forces, drag, none of it over a step. Returns gravity [m/s^2].
Vector3 set_forces_at(const Model& model, EffectSet effects, const VectorRef& q, const VectorRef& w,
                      const std::vector<ExternalWrench>& wrenches, Workspace::Impl& ws);

/// Poses, velocities, inertias of all that is in `ranges`.
void compute_kinematics(const Model& model, const VectorRef& q, const VectorRef& v,
                        std::span<const BodyRange> ranges, Data& data);

/// Applied forces, as far as motors can give them, and servos: into tau and diagonal; servos that
/// can be at their limit become rows. h [s]: over which they act.
void set_motor_forces(const StepContext& at, double h, const Input& input, Workspace::Impl& ws);

/// w* = w + h inv(M + diagonal) (n + u - ...): the velocity if there were no constraint. Needs
/// prepare_step; makes rows of servos that can be at their limit, in ws.constraints. Where M is
/// singular the report says so.
void compute_free_velocity(const StepArguments& step, Workspace::Impl& ws, VectorX& w_free,
                           StepReport& report);

/// w + h inv(M + diagonal) (tau + forces on bodies), of all that is awake; the second half of the
/// above.
void accelerate(const Model& model, double h, const Vector3& gravity, const VectorRef& w,
                Workspace::Impl& ws, VectorX& w_free,
                StepReport& report);  // Parameters: all it depends on

}  // namespace counterpoint
