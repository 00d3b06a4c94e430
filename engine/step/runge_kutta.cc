#include "counterpoint/engine/step/runge_kutta.h"

#include <string>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/step/equality_motion.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {

void refuse_constraints(const Model& model, EffectSet effects) {
  if (effects.has(Effect::kClosures))
    for (const Closure& closure : model.closures()) {
      const char* refused = closure.rope || closure.linear.acts || closure.angular.acts
                                ? "a spring or a rope"
                            : closure.can_break() ? "one that can break"
                                                  : nullptr;
      if (refused != nullptr)
        throw InputError(
            "runge_kutta_4 takes closures as rigid and finds no forces in them; "
            "closure '" +
            closure.name + "' is " + refused + ": use implicit_midpoint or semi_implicit_euler");
    }
  std::string found;
  for (const Effect effect :
       {Effect::kDryFriction, Effect::kLimits, Effect::kEffortLimits, Effect::kVelocityLimits,
        Effect::kTendons, Effect::kActuators, Effect::kContacts}) {
    if (effects.has(effect))
      found += (found.empty() ? "" : ", ") + std::string(effect_name(effect));
  }
  if (found.empty()) return;
  throw InputError(
      "runge_kutta_4 integrates smooth effects, closures and mimic joints; this scene calls for " +
      found +
      ": switch them off (`effects:` in the scene file), or use implicit_midpoint or "
      "semi_implicit_euler");
}

void exponent_rate(const Model& model, const VectorX& theta, const VectorX& w, VectorX& rate) {
  rate = w;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kSpherical && body.joint_type != JointType::kFloating)
      continue;
    const int k = body.v_index + joint_num_linear(body.joint_type);
    const Vector3 t = theta.segment<3>(k), omega = w.segment<3>(k), tw = t.cross(omega);
    rate.segment<3>(k) += 0.5 * tw + t.cross(tw) / 12.0;
  }
}

void compute_acceleration(const StepContext& at, const Input& input, Workspace::Impl& ws,
                          VectorX& acceleration, StepReport& report) {
  // A time step of zero makes the implicit terms vanish.
  CoordinateForces& forces = ws.motion.forces;
  set_motor_forces(at, 0.0, input, ws.sleepers.sleep_mask(), forces, ws.constraints, ws.counts);
  add_joint_forces(at, 0.0, forces.diagonal, forces.tau, ws.counts);
  const Vector3 gravity = set_forces_at(at.model, at.effects, at.q, at.v, input.wrenches,
                                        ws.taut_links, ws.stage, ws.motion.external, ws.counts);
  ws.displacement.setZero();
  accelerate(at.model, 1.0, gravity, ws.displacement, ws.sleepers.awake(), nullptr, ws.stage.at,
             ws.stage.velocity, ws.motion, acceleration, report);
}

void step_runge_kutta(const StepArguments& step, Workspace::Impl& ws, State& next,
                      StepReport& report) {
  const auto& [model, options, settings, state, input, effects, z] = step;
  refuse_constraints(model, effects);
  RungeKuttaStages& stages = ws.stages;
  const double h = step.h();
  const bool constrained = has_equalities(model, effects, z);
  EqualityMotion equalities(ws);
  stages.theta.setZero(model.nv());
  stages.at = state;
  stages.theta_sum.setZero(model.nv());
  stages.v_sum.setZero(model.nv());
  for (int s = 0; s < 4; ++s) {
    const auto [node, weight] = kRungeKuttaStages[s];
    if (s > 0) {
      stages.theta = node * h * stages.theta_rate;
      integrate_configuration(model, state.q, stages.theta, 1.0, stages.at.q);
      stages.at.v = state.v + node * h * stages.acceleration;
    }
    exponent_rate(model, stages.theta, stages.at.v, stages.theta_rate);
    const StepContext at{model, options, effects, stages.at.q, stages.at.v, z};
    compute_acceleration(at, input, ws, stages.acceleration, report);
    if (report.succeeded() && constrained)
      equalities.constrain_acceleration(at, stages.acceleration, report);
    if (!report.succeeded()) break;
    stages.theta_sum += h / 6.0 * weight * stages.theta_rate;
    stages.v_sum += h / 6.0 * weight * stages.acceleration;
  }
  next.time = state.time + h;
  next.v = state.v + stages.v_sum;
  next.q = state.q;
  integrate_configuration(model, state.q, stages.theta_sum, 1.0, next.q);
  if (constrained && report.succeeded()) equalities.project(step, next, report);
  if (report.succeeded()) ws.free_groups.correct(step.context(), input, next.q, next);
  ws.constraints.clear();  // equalities have no forces that a later step would start from
}

}  // namespace counterpoint
