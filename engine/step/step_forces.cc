#include "counterpoint/engine/step/step_forces.h"

#include <algorithm>

#include "counterpoint/engine/diagnosis/failure_cause.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/forces/drag.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/midpoint.h"

namespace counterpoint {
namespace {

void clear_external(Data& data) {
  data.has_external = true;
  for (Force& f : data.external) f = Force();
}

struct VelocityRange {
  int begin, size;
};

VelocityRange velocities(const Model& model, BodyRange bodies) {
  const int begin = model.body(bodies.begin).v_index;
  const Body& last = model.body(bodies.end - 1);
  return {begin, last.v_index + joint_nv(last.joint_type) - begin};
}

/// rnea's joint forces for accelerations a (nv) under what acts on bodies in ws.data and the
/// impulses of pairs over h [s], where they act.
void add_joint_forces_of(const StepArguments& step, const VectorX& a, const Vector3& gravity,
                         bool impulses, Workspace::Impl& ws) {
  Data& data = ws.data;
  if (impulses && !ws.constraints.pairs.empty()) {
    if (!data.has_external) clear_external(data);
    for (size_t i = 0; i < ws.constraints.pairs.size(); ++i) {
      const PairConstraint& pair = ws.constraints.pairs[i];
      const double* f = ws.impulse.data() + ws.problem.first_row(static_cast<int>(i));
      add_pair_impulse(pair, pair_impulse(pair, f) * (1.0 / step.h()), data, data.external);
    }
  }
  ws.not_wanted.resize(step.model.nv());
  rnea(step.model, a, gravity, data, ws.not_wanted);
  for (size_t i = 0; i < ws.joint_force.size(); ++i) ws.joint_force[i] += data.F[i];
}

/// Of a step to `next`, by joint, into ws.joint_force: the mean over the step.
void find_joint_forces(const StepArguments& step, const State& next, Workspace::Impl& ws) {
  const Model& model = step.model;
  ws.joint_force.assign(static_cast<size_t>(model.num_bodies()), Force());
  if (step.options.integrator == Integrator::kSemiImplicitEuler) {
    ws.acceleration = (next.v - step.state.v) / step.h();
    set_external(step.input.wrenches, step.effects, ws);
    if (set_drag(model, step.effects, step.h(), ws)) {
      compute_body_velocities(model, next.v, ws.data, ws.velocity);
      add_drag_inverse(step.h(), ws.velocity, ws.data);
    }
    return add_joint_forces_of(step, ws.acceleration, ws.start.gravity(), true, ws);
  }
  // next.v = w_c + h a / 2, w_m = w + h a / 2 (midpoint.h).
  ws.acceleration = (ws.middle - step.state.v) / (0.5 * step.h());
  const Vector3 gravity = set_middle(step.context(), ws.middle, step.input.wrenches, ws);
  add_joint_forces_of(step, ws.acceleration, gravity, false, ws);
  const BodyRange all = moving_bodies(model);
  compute_kinematics(model, step.state.q, step.state.v, {&all, 1}, ws.data);
  if (ws.constraints.empty()) return;
  ws.data.has_coriolis = ws.data.has_external = false;
  for (Motion& c : ws.data.c) c = Motion();
  ws.acceleration = (next.v - 2.0 * ws.middle + step.state.v) / step.h();  // (w_c - w_m) / h
  add_joint_forces_of(step, ws.acceleration, Vector3::Zero(), true, ws);
}

}  // namespace

void find_taut_rates(const StepArguments& step, const State& next, Workspace::Impl& ws) {
  if (ws.taut_links.needs_joint_forces()) find_joint_forces(step, next, ws);
  const bool pushed = step.effects.has(Effect::kExternalWrenches);
  const std::span<const ExternalWrench> wrenches =
      pushed ? std::span(step.input.wrenches) : std::span<const ExternalWrench>();
  ws.taut_links.find_rates(ws.constraints, ws.problem, ws.impulse, step.h(), ws.joint_force,
                           wrenches, ws.data);
}

void set_external(const std::vector<ExternalWrench>& wrenches, EffectSet effects,
                  Workspace::Impl& ws) {
  Data& data = ws.data;
  const bool pushed = effects.has(Effect::kExternalWrenches) && !wrenches.empty();
  data.has_external = pushed || ws.taut_links.loses();
  if (!data.has_external) return;
  clear_external(data);
  if (ws.taut_links.loses()) ws.taut_links.add_losses(data);
  if (!pushed) return;
  ws.counts.add(Effect::kExternalWrenches);
  for (const ExternalWrench& w : wrenches) {
    const Vector3 arm = data.X_WB[w.body].rotation * w.point;
    data.external[w.body] += Force{w.wrench.torque + arm.cross(w.wrench.force), w.wrench.force};
  }
}

bool set_drag(const Model& model, EffectSet effects, double h, Workspace::Impl& ws) {
  ws.data.added.clear();
  if (!effects.has(Effect::kDrag)) return false;
  ws.counts.add(Effect::kDrag);
  compute_drag(model, h, ws.data);
  if (!ws.data.has_external) clear_external(ws.data);
  return true;
}

Vector3 set_body_forces(const Model& model, EffectSet effects, Workspace::Impl& ws) {
  ws.data.has_coriolis = effects.has(Effect::kCoriolis);
  if (ws.data.has_coriolis) {
    ws.counts.add(Effect::kCoriolis);
  } else {
    for (Motion& c : ws.data.c) c = Motion();
  }
  if (!effects.has(Effect::kGravity)) return Vector3::Zero();
  ws.counts.add(Effect::kGravity);
  return model.gravity();
}

const VectorX& rotor_inertia(const Model& model, EffectSet effects, const Workspace::Impl& ws) {
  return effects.has(Effect::kArmature) ? model.armature() : ws.no_rotors;
}

Vector3 set_forces_at(const Model& model, EffectSet effects, const VectorRef& q, const VectorRef& w,
                      const std::vector<ExternalWrench>& wrenches, Workspace::Impl& ws) {
  Data& data = ws.data;
  const BodyRange all = moving_bodies(model);
  compute_kinematics(model, q, w, {&all, 1}, data);
  std::fill(data.has_mean_force.begin(), data.has_mean_force.end(), 0);
  data.mean_rotor_force.setZero();
  set_external(wrenches, effects, ws);
  const Vector3 gravity = set_body_forces(model, effects, ws);
  if (set_drag(model, effects, 1.0, ws)) {
    add_drag_inverse(1.0, data.V, data);
    data.added.clear();
  }
  return gravity;
}

void compute_kinematics(const Model& model, const VectorRef& q, const VectorRef& v,
                        std::span<const BodyRange> ranges, Data& data) {
  for (const BodyRange& bodies : ranges) {
    compute_poses(model, q, bodies, data);
    compute_velocities(model, v, bodies, data);
    compute_inertias(model, bodies, data);
  }
}

void set_motor_forces(const StepContext& at, double h, const Input& input, Workspace::Impl& ws) {
  const EffectSet effects = at.effects;
  ws.tau.setZero();
  ws.diagonal.setZero();
  if (effects.has(Effect::kAppliedForces) && input.applied_force.size() > 0) {
    ws.counts.add(Effect::kAppliedForces);
    ws.tau = input.applied_force;
  }
  if (effects.has(Effect::kServos)) {
    ws.counts.add(Effect::kServos);
    add_servo_rows(at, h, input, ws.sleepers.idle_bodies(), ws.tau, ws.constraints.joints);
  }
  if (effects.has(Effect::kEffortLimits)) {
    ws.counts.add(Effect::kEffortLimits);
    limit_applied_forces(at.model, effects, ws.tau);
  }
  if (effects.has(Effect::kServos)) add_servos(at, h, input, ws.diagonal, ws.tau);
}

void accelerate(const Model& model, double h, const Vector3& gravity, const VectorRef& w,
                Workspace::Impl& ws, VectorX& w_free, StepReport& report) {
  w_free = w;
  for (const BodyRange& bodies : ws.sleepers.awake()) {
    int singular = 0;
    if (!aba(model, ws.tau, ws.diagonal, gravity, bodies, ws.data, ws.acceleration, &singular)) {
      report.status = contact::Status::kSingular;
      report.fault = singular_inertia_fault(model, singular, ws.diagonal, ws.data);
      return;
    }
    const VelocityRange v = velocities(model, bodies);
    w_free.segment(v.begin, v.size) += h * ws.acceleration.segment(v.begin, v.size);
  }
}

void compute_free_velocity(const StepArguments& step, Workspace::Impl& ws, VectorX& w_free,
                           StepReport& report) {
  const PhaseTimer timer(ws.times, &PhaseTimes::dynamics);
  const auto& [model, options, settings, state, input, effects] = step;
  const StepContext at = step.context();
  const double h = step.h();
  const Vector3& gravity = ws.start.gravity();
  for (const BodyRange& bodies : ws.sleepers.awake()) compute_inertias(model, bodies, ws.data);
  set_motor_forces(at, h, input, ws);
  add_joint_forces(at, h, ws.diagonal, ws.tau, ws.counts);
  set_external(input.wrenches, effects, ws);
  if (ws.data.has_coriolis) ws.tau += ws.data.mean_rotor_force;
  if (set_drag(model, effects, h, ws))
    add_drag(model, h, gravity, ws.velocity_acceleration, ws.data);
  accelerate(model, h, gravity, state.v, ws, w_free, report);
}

}  // namespace counterpoint
