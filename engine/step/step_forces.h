// Forces of a step beside those of constraints, and the velocity that they alone lead to.
#pragma once

#include <span>

#include "counterpoint/engine/forces/driven/prescribed.h"
#include "counterpoint/engine/forces/taut_links.h"
#include "counterpoint/engine/step/sleep.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// The input of the stages of a forward step after prepare_step.
struct StageInput {
  const StepArguments& step;
  const StepStart& start;
  const Sleepers& sleepers;
  const TautLinks& taut_links;
  EffectCounts& counts;          ///< stages write how often an effect ran
  PrescribedMotion* prescribed;  ///< found for the step; null where it does not act
  contact::ThreadPool* pool;     ///< shares the work; may be null
};

/// Forces on single coordinates. Their part that is implicit in the velocity, h times the slope, is
/// added to the diagonal of M.
struct CoordinateForces {
  VectorX tau;       ///< nv [N, N m]
  VectorX diagonal;  ///< nv [kg, kg m^2]
};

/// Forces beside those of constraints, and the scratch memory of the dynamics that use them.
struct FreeMotion {
  explicit FreeMotion(const Model& model);

  CoordinateForces forces;
  ExternalForces external;
  DynamicsScratch scratch;
  VectorX acceleration;                       ///< nv
  std::vector<Motion> velocity_acceleration;  ///< per body: scratch of drag
};

/// Kinematics and velocity-dependent forces within a step: at the middle of implicit_midpoint, at
/// the stages of runge_kutta_4.
struct StageMotion {
  explicit StageMotion(const Model& model) : at(model), velocity(model) {}
  Kinematics at;
  VelocityForces velocity;
};

/// Sets the applied wrenches and the losses of taut links (taut_links.h), at these poses.
void set_external(const std::vector<ExternalWrench>& wrenches, EffectSet effects,
                  const TautLinks& taut_links, const Kinematics& at, ExternalForces& external,
                  EffectCounts& counts);

/// Writes h C of every drag into external.added (drag.h), and makes external.external usable if it
/// was not. Returns false, with external.added empty, if there is no drag.
bool set_drag(const Model& model, EffectSet effects, double h, const Kinematics& at,
              ExternalForces& external, EffectCounts& counts);

/// Switches velocity-dependent forces on or off as the effects say; returns gravity [m/s^2], zero
/// where it is off.
Vector3 set_body_forces(const Model& model, EffectSet effects, VelocityForces& velocity,
                        EffectCounts& counts);

/// Poses, velocities and inertias of all bodies at (q, v).
void compute_kinematics(const Model& model, const VectorRef& q, const VectorRef& v, Kinematics& at);

/// Kinematics at (q, w) of all bodies, and the forces there, none of them a mean over a step:
/// wrenches, velocity-dependent forces, drag. Returns gravity [m/s^2].
Vector3 set_forces_at(const Model& model, EffectSet effects, const VectorRef& q, const VectorRef& w,
                      const std::vector<ExternalWrench>& wrenches, const TautLinks& taut_links,
                      StageMotion& stage, ExternalForces& external, EffectCounts& counts);

/// Sets forces.tau and forces.diagonal to applied forces, within the limits of the motors, and
/// servos that act over h [s]; servos that can be at their limit become rows of `joints`.
void set_motor_forces(const StepContext& at, double h, const Input& input, SleepMask idle,
                      CoordinateForces& forces, ConstraintSet& constraints, EffectCounts& counts);

/// w_free = w + h inv(M + motion.forces.diagonal) (motion.forces.tau + gravity, velocity-dependent
/// forces and motion.external) of the awake trees, and w elsewhere. Overwrites motion.acceleration
/// and motion.scratch. pool: threads that share the trees; may be null. Where M is singular, sets
/// status and fault of the report; w_free is then invalid.
void accelerate(const Model& model, double h, const Vector3& gravity, const VectorRef& w,
                std::span<const BodyRange> awake, contact::ThreadPool* pool, const Kinematics& at,
                const VelocityForces& velocity, FreeMotion& motion, VectorX& w_free,
                StepReport& report);

/// The free-velocity stage: sets motion.forces and motion.external, then accelerates from state.v:
/// w_free (nv) is the velocity without constraints. Needs inertias in in.start. Adds rows of servos
/// that can be at their limit to `constraints`, and status and fault of a failure to `report`.
void find_free_velocity(const StageInput& in, FreeMotion& motion, ConstraintSet& constraints,
                        VectorX& w_free, StepReport& report);

}  // namespace counterpoint
