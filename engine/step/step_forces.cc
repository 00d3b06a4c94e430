#include "counterpoint/engine/step/step_forces.h"

#include <algorithm>
#include <atomic>

#include "counterpoint/engine/diagnosis/failure_cause.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/drag.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/tree_parts.h"

namespace counterpoint {
namespace {

struct VelocityRange {
  int begin, size;
};

VelocityRange velocities(const Model& model, BodyRange bodies) {
  const int begin = model.body(bodies.begin).v_index;
  const Body& last = model.body(bodies.end - 1);
  return {begin, last.v_index + joint_nv(last.joint_type) - begin};
}

}  // namespace

FreeMotion::FreeMotion(const Model& model)
    : forces{VectorX::Zero(model.nv()), VectorX::Zero(model.nv())},
      external(model),
      scratch(model),
      acceleration(VectorX::Zero(model.nv())),
      velocity_acceleration(model.drags().empty() ? 0 : model.num_bodies()) {}

void set_external(const std::vector<ExternalWrench>& wrenches, EffectSet effects,
                  const TautLinks& taut_links, const Kinematics& at, ExternalForces& external,
                  EffectCounts& counts) {
  const bool pushed = effects.has(Effect::kExternalWrenches) && !wrenches.empty();
  external.has_external = pushed || taut_links.loses();
  if (!external.has_external) return;
  external.begin();
  if (taut_links.loses()) taut_links.add_losses(external);
  if (!pushed) return;
  counts.add(Effect::kExternalWrenches);
  for (const ExternalWrench& w : wrenches) {
    const Vector3 arm = at.X_WB[w.body].rotation * w.point;
    external.external[w.body] += Force{w.wrench.torque + arm.cross(w.wrench.force), w.wrench.force};
  }
}

bool set_drag(const Model& model, EffectSet effects, double h, const Kinematics& at,
              ExternalForces& external, EffectCounts& counts) {
  external.added.clear();
  if (!effects.has(Effect::kDrag)) return false;
  counts.add(Effect::kDrag);
  compute_drag(model, h, at, external);
  if (!external.has_external) external.begin();
  return true;
}

Vector3 set_body_forces(const Model& model, EffectSet effects, VelocityForces& velocity,
                        EffectCounts& counts) {
  velocity.has_coriolis = effects.has(Effect::kCoriolis);
  if (velocity.has_coriolis) counts.add(Effect::kCoriolis);
  if (!effects.has(Effect::kGravity)) return Vector3::Zero();
  counts.add(Effect::kGravity);
  return model.gravity();
}

void compute_kinematics(const Model& model, const VectorRef& q, const VectorRef& v,
                        Kinematics& at) {
  compute_poses(model, q, at);
  compute_velocities(model, v, at);
  compute_inertias(model, at);
}

Vector3 set_forces_at(const Model& model, EffectSet effects, const VectorRef& q, const VectorRef& w,
                      const std::vector<ExternalWrench>& wrenches, const TautLinks& taut_links,
                      StageMotion& stage, ExternalForces& external, EffectCounts& counts) {
  compute_kinematics(model, q, w, stage.at);
  set_external(wrenches, effects, taut_links, stage.at, external, counts);
  const Vector3 gravity = set_body_forces(model, effects, stage.velocity, counts);
  if (set_drag(model, effects, 1.0, stage.at, external, counts)) {
    add_drag_inverse(1.0, stage.at.V, external);
    external.added.clear();
  }
  return gravity;
}

void set_motor_forces(const StepContext& at, double h, const Input& input, SleepMask idle,
                      CoordinateForces& forces, ConstraintSet& constraints, EffectCounts& counts) {
  const EffectSet effects = at.effects;
  forces.tau.setZero();
  forces.diagonal.setZero();
  if (effects.has(Effect::kAppliedForces) && input.applied_force.size() > 0) {
    counts.add(Effect::kAppliedForces);
    forces.tau = input.applied_force;
  }
  if (effects.has(Effect::kServos)) {
    counts.add(Effect::kServos);
    add_servo_rows(at, h, input, idle, forces.tau, constraints);
  }
  if (effects.has(Effect::kEffortLimits)) {
    counts.add(Effect::kEffortLimits);
    limit_applied_forces(at.model, effects, forces.tau);
  }
  if (effects.has(Effect::kServos)) add_servos(at, h, input, forces.diagonal, forces.tau);
}

void accelerate(const Model& model, double h, const Vector3& gravity, const VectorRef& w,
                std::span<const BodyRange> awake, contact::ThreadPool* pool, const Kinematics& at,
                const VelocityForces& velocity, FreeMotion& motion, VectorX& w_free,
                StepReport& report) {
  const VectorX &tau = motion.forces.tau, &diagonal = motion.forces.diagonal;
  w_free = w;
  std::atomic<int> singular{0};  // the last body that moves no inertia, whichever thread finds it
  for_each_part(model, awake, pool, [&](const BodyRange& bodies) {
    int body = 0;
    if (!aba(model, tau, diagonal, gravity, bodies,
             BodyState(at, velocity, motion.external, motion.scratch), motion.acceleration,
             &body)) {
      for (int last = singular; last < body && !singular.compare_exchange_weak(last, body);) {
      }
      return;
    }
    const VelocityRange v = velocities(model, bodies);
    w_free.segment(v.begin, v.size) += h * motion.acceleration.segment(v.begin, v.size);
  });
  if (singular == 0) return;
  report.status = contact::Status::kSingular;
  report.fault = singular_inertia_fault(model, singular, diagonal, at, motion.scratch);
}

void find_free_velocity(const StageInput& in, FreeMotion& motion, ConstraintSet& constraints,
                        VectorX& w_free, StepReport& report) {
  const auto& [model, options, settings, state, input, effects, z] = in.step;
  const StepContext context = in.step.context();
  const double h = in.step.h();
  const Kinematics& at = in.start.kinematics();
  const VelocityForces& velocity = in.start.velocity_forces();
  auto& [tau, diagonal] = motion.forces;
  set_motor_forces(context, h, input, in.sleepers.sleep_mask(), motion.forces, constraints,
                   in.counts);
  add_joint_forces(context, h, diagonal, tau, in.counts);
  set_external(input.wrenches, effects, in.taut_links, at, motion.external, in.counts);
  if (velocity.has_coriolis) tau += velocity.mean_rotor_force;
  if (set_drag(model, effects, h, at, motion.external, in.counts))
    add_drag(model, h, in.start.gravity(), at, velocity, motion.velocity_acceleration,
             motion.external);
  if (in.prescribed != nullptr) in.prescribed->lock(h, state.v, diagonal, tau);
  accelerate(model, h, in.start.gravity(), state.v, in.sleepers.awake(), in.pool, at, velocity,
             motion, w_free, report);
}

}  // namespace counterpoint
