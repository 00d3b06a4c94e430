#include "counterpoint/engine/step/taut_rates.h"

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/forces/drag.h"
#include "counterpoint/engine/step/midpoint.h"

namespace counterpoint {
namespace {

/// Adds the wrenches through the joints at accelerations a (nv), by rnea.
void add_joint_forces_of(const Model& model, const VectorX& a, const Vector3& gravity,
                         const BodyState& bodies, VectorX& discarded,
                         std::vector<Force>& joint_force) {
  discarded.resize(model.nv());
  rnea(model, a, gravity, bodies, discarded);
  for (size_t i = 0; i < joint_force.size(); ++i) joint_force[i] += bodies.scratch.F[i];
}

/// Adds the impulses of pair constraints over h [s] to the external forces.
void add_pair_forces(const ConstraintSet& constraints, const ContactSolution& solution, double h,
                     const Kinematics& at, ExternalForces& external) {
  if (constraints.pairs.empty()) return;
  if (!external.has_external) external.begin();
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    const double* f = solution.impulse.data() + solution.problem.first_row(static_cast<int>(i));
    add_pair_impulse(pair, pair_impulse(pair, f) * (1.0 / h), at, external.external);
  }
}

/// Finds the mean wrenches through the joints over the step to `next`, into ws.joint_force.
void find_joint_forces(const StepArguments& step, const State& next, Workspace::Impl& ws) {
  const Model& model = step.model;
  const double h = step.h();
  const Kinematics& at = ws.start.kinematics();
  ExternalForces& external = ws.motion.external;
  VectorX& a = ws.motion.acceleration;
  const auto add = [&](const Vector3& gravity, const BodyState& bodies) {
    add_joint_forces_of(model, a, gravity, bodies, ws.inverse.discarded, ws.joint_force);
  };
  ws.joint_force.assign(static_cast<size_t>(model.num_bodies()), Force());
  if (step.options.integrator == Integrator::kSemiImplicitEuler) {
    a = (next.v - step.state.v) / h;
    set_external(step.input.wrenches, step.effects, ws.taut_links, at, external, ws.counts);
    if (set_drag(model, step.effects, h, at, external, ws.counts)) {
      compute_body_velocities(model, next.v, at, ws.inverse.body_velocity);
      add_drag_inverse(h, ws.inverse.body_velocity, external);
    }
    add_pair_forces(ws.constraints, ws.solution, h, at, external);
    return add(ws.start.gravity(), ws.bodies());
  }
  // next.v = w_c + h a / 2, w_m = w + h a / 2 (midpoint.h): smooth forces are taken at the poses
  // q_m, impulses at q.
  const VectorX& w_m = ws.midpoint.w_m;
  a = (w_m - step.state.v) / (0.5 * h);
  const Vector3 gravity = set_middle(step.context(), w_m, step.input.wrenches, ws);
  add(gravity, {ws.stage.at, ws.stage.velocity, external, ws.motion.scratch});
  if (ws.constraints.empty()) return;
  external.has_external = false;
  add_pair_forces(ws.constraints, ws.solution, h, at, external);
  a = (next.v - 2.0 * w_m + step.state.v) / h;  // (w_c - w_m) / h
  add(Vector3::Zero(), {at, ws.no_velocity_forces, external, ws.motion.scratch});
}

}  // namespace

void find_taut_rates(const StepArguments& step, const State& next, Workspace::Impl& ws) {
  if (ws.taut_links.needs_joint_forces()) find_joint_forces(step, next, ws);
  const bool pushed = step.effects.has(Effect::kExternalWrenches);
  const std::span<const ExternalWrench> wrenches =
      pushed ? std::span(step.input.wrenches) : std::span<const ExternalWrench>();
  ws.taut_links.find_rates(ws.constraints, ws.solution.problem, ws.solution.impulse, step.h(),
                           ws.joint_force, wrenches, ws.start.kinematics());
}

}  // namespace counterpoint
