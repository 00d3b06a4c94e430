#include <algorithm>
#include <limits>

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/forces/drag.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/midpoint.h"
#include "counterpoint/engine/step/step_forces.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Of the two bodies at a contact at the end of the step, across the normal; y: in its rows.
Vector3 slip(const PairConstraint& pair, const double* y, const Workspace::Impl& ws) {
  const Matrix3& frame = pair.frame;
  const contact::Law& law = pair.law;
  if (law.rows >= 3)
    return (y[1] - law.bias[1]) * frame.col(1) + (y[2] - law.bias[2]) * frame.col(2);
  const Vector3 v =
      relative_velocity_at(pair.position, pair.body_a, pair.body_b, ws.data, ws.velocity);
  return v - v.dot(frame.col(0)) * frame.col(0);
}

/// Impulses of the pairs at the velocity v_next into ws.pair_impulses, row by row; those of
/// contacts with friction four at a time.
void evaluate_pairs(const Model& model, const VectorRef& v_next, Workspace::Impl& ws) {
  size_t rows = 0;
  for (const PairConstraint& pair : ws.constraints.pairs)
    rows += static_cast<size_t>(pair.law.rows);
  if (ws.pair_velocities.size() < rows) ws.pair_velocities.resize(rows);
  if (ws.pair_impulses.size() < rows) ws.pair_impulses.resize(rows);
  double* y = ws.pair_velocities.data();
  double* f = ws.pair_impulses.data();
  ws.lanes.clear();
  int row = 0;
  for (const PairConstraint& pair : ws.constraints.pairs) {
    pair_velocity(model, pair, ws.data, v_next, ws.chain, y + row);
    if (!ws.lanes.add(pair.law, 0.0, row, 0)) contact::impulse(pair.law, y + row, f + row);
    row += pair.law.rows;
  }
  ws.lanes.impulses(y, f);
}

/// J' f of all constraints at the velocity v_next, of the bodies in ws.velocity, into ws.tau [N s];
/// contacts and closures listed in `out`.
void recover_impulses(const Model& model, const VectorRef& v_next, double h, Workspace::Impl& ws,
                      Inverse& out) {
  ws.tau.setZero();
  out.contacts.clear();
  out.joints.clear();
  out.closures.assign(model.closures().size(), {});
  for (Force& f : ws.body_impulse) {  // number by number: copies of a zero wait for its stores
    f.torque.setZero();
    f.force.setZero();
  }
  const ConstraintSet& constraints = ws.constraints;
  evaluate_pairs(model, v_next, ws);
  const double* next = ws.pair_impulses.data();
  const double* y = ws.pair_velocities.data();
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    const Force impulse = pair_impulse(pair, next);
    add_pair_impulse(pair, impulse, ws.data, ws.body_impulse);
    if (i < constraints.contacts.size()) {
      ContactForce& contact = out.contacts.emplace_back();
      contact.contact = constraints.contacts[i];
      contact.force = impulse.force / h;  // to the bit as the forward step
      contact.slip = slip(pair, y, ws);
    } else {
      ClosureForce& closure = out.closures[constraints.closures[i - constraints.contacts.size()]];
      closure.position = pair.position;
      closure.force += impulse * (1.0 / h);
    }
    next += pair.law.rows;
    y += pair.law.rows;
  }
  project_on_joints(model, ws.data, ws.body_impulse, ws.tau);
  for (const JointConstraint& j : ws.constraints.joints) {
    contact::Rows velocity(1);
    velocity[0] = joint_row_velocity(j, v_next);
    const double f = contact::impulse(j.law, velocity)[0];
    out.joints.push_back({j.effect, j.v_index[0], j.coefficient[0] * f / h});
    for (int k = 0; k < 2; ++k)
      if (j.v_index[k] >= 0) ws.tau[j.v_index[k]] += j.coefficient[k] * f;
  }
}

/// The laws of a step that was softened, as they were solved.
void soften_constraints(const Model& model, const Softening& softening, Workspace::Impl& ws) {
  if (!softening.any()) return;
  ws.softened_trees.find(model, ws.constraints, softening);
  const contact::Softness softness = softness_of(softening);
  for (PairConstraint& pair : ws.constraints.pairs)
    if (ws.softened_trees.holds(model.body(pair.body_a).tree, model.body(pair.body_b).tree))
      pair.law = contact::soften(pair.law, softness);
  for (JointConstraint& row : ws.constraints.joints)
    if (ws.softened_trees.holds(model.tree_of_velocity(row.v_index[0]), -1))
      row.law = contact::soften(row.law, softness);
}

/// What is left of the applied force when the servos' share is taken out: over h [s], at velocities
/// w.
void subtract_servos(const InverseArguments& step, double h, const VectorRef& w,
                     Workspace::Impl& ws, Inverse& out) {
  const Model& model = step.model;
  out.servo_force.setZero(static_cast<Eigen::Index>(model.servos().size()));
  if (!step.effects.has(Effect::kServos)) return;
  ws.counts.add(Effect::kServos);
  compute_servo_forces(model, h, step.q, w, step.known, out.servo_force);
  for (size_t i = 0; i < model.servos().size(); ++i)
    out.applied_force[model.body(model.servos()[i].joint + 1).v_index] -= out.servo_force[i];
}

/// What is not known is not a number.
void void_inverse(const Model& model, Inverse& out) {
  out.applied_force.setConstant(model.nv(), kNaN);
  out.contact_force.setConstant(model.nv(), kNaN);
  out.servo_force.setConstant(static_cast<Eigen::Index>(model.servos().size()), kNaN);
  out.force_scale = kNaN;
  out.contacts.clear();
  out.closures.clear();
  out.joints.clear();
}

/// u of the semi-implicit step from its constraints' share.
void invert_euler(const InverseArguments& step, Workspace::Impl& ws, Inverse& out) {
  const auto& [model, options, q, v, q_next, v_next, known, effects, exact_q_next] = step;
  const double h = step.h();
  ws.acceleration = (v_next - v) / h;
  set_external(known.wrenches, effects, ws);
  if (set_drag(model, effects, h, ws)) add_drag_inverse(h, ws.velocity, ws.data);
  rnea(model, ws.acceleration, ws.start.gravity(), ws.data, ws.tau);
  if (ws.data.has_coriolis) ws.tau -= ws.data.mean_rotor_force;
  add_joint_forces_inverse(step.context(), h, v_next, ws.tau, ws.counts);
  out.applied_force = ws.tau - out.contact_force;
  subtract_servos(step, h, v_next, ws, out);
}

/// Rounding of the poses that w_c is read off, relative, and what stiff contacts of light links
/// make of it (85 times as much, humanoid): below what differences of derivatives ask about.
constexpr double kPoseRounding = 32768.0 * std::numeric_limits<double>::epsilon();

/// The same of the midpoint rule (midpoint.h). Impulses are in the velocities, not in the forces.
/// refined: w_c, in ws.contact_velocity, is as exact as velocities are.
void invert_midpoint(const InverseArguments& step, bool refined, Workspace::Impl& ws,
                     Inverse& out) {
  const auto& [model, options, q, v, q_next, v_next, known, effects, exact_q_next] = step;
  const double h = step.h();
  if (refined) {
    ws.middle = v + v_next - ws.contact_velocity;
  } else {
    find_middle(step, ws, ws.middle);
  }
  const Vector3 gravity = set_middle(step.context(), ws.middle, known.wrenches, ws);
  ws.acceleration = (ws.middle - v) / (0.5 * h);
  rnea(model, ws.acceleration, gravity, ws.data, ws.tau);
  add_joint_forces_inverse(step.context(), 0.5 * h, ws.middle, ws.tau, ws.counts);
  out.applied_force = ws.tau;
  subtract_servos(step, 0.5 * h, ws.middle, ws, out);
  // What they gave in the step is that at w_c.
  if (effects.has(Effect::kServos) && !ws.constraints.empty())
    compute_servo_forces(model, 0.5 * h, q, ws.contact_velocity, known, out.servo_force);
}

/// The velocity that the impulses of a step are functions of, w+, or w_c of the midpoint rule, into
/// ws.contact_velocity; the constraints of the step, those found by this velocity too, with the
/// laws that were solved, into ws.constraints; the bodies' velocities at it into ws.velocity.
void find_constraints(const InverseArguments& step, Workspace::Impl& ws) {
  const auto& [model, options, q, v, q_next, v_next, known, effects, exact_q_next] = step;
  const bool midpoint = options.integrator == Integrator::kImplicitMidpoint;
  const bool found = !midpoint || q_next.size() > 0;
  ws.contact_velocity = v_next;
  if (midpoint && found) {
    configuration_difference(model, q, q_next, ws.contact_velocity);
    ws.contact_velocity /= options.time_step;
  } else if (midpoint) {
    ws.contact_velocity = 0.5 * (v + v_next);  // which it is without constraints
  }
  ws.constraints = ws.start.constraints();
  compute_body_velocities(model, ws.contact_velocity, ws.data, ws.velocity);
  ws.finder.find_overrun(step.context(), {ws.contact_velocity, &ws.velocity}, ws.data,
                         ws.constraints);
  if (!found && !ws.constraints.empty())
    throw InputError(
        "the inverse of implicit_midpoint needs q at the end of the step where there are "
        "constraints");
  soften_constraints(model, known.softening, ws);
}

/// w_c from velocities instead of rounded poses, where that is possible.
bool refine(const InverseArguments& step, Workspace::Impl& ws) {
  if (step.options.integrator != Integrator::kImplicitMidpoint) return false;
  if (ws.constraints.empty() || step.exact_q_next) return false;
  const double rounding = kPoseRounding * (1.0 + step.q.lpNorm<Eigen::Infinity>());
  return refine_contact_velocity(step, rounding, ws, ws.contact_velocity);
}

double largest_force(const Workspace::Impl& ws, const Inverse& out) {
  double largest = 0.0;
  for (const VectorX* force : {&ws.tau, &out.contact_force, &out.applied_force})
    largest = std::max(largest, force->lpNorm<Eigen::Infinity>());
  return largest;
}

}  // namespace

void invert_step(const InverseArguments& step, Workspace::Impl& ws, Inverse& out) {
  const auto& [model, options, q, v, q_next, v_next, known, effects, exact_q_next] = step;
  check_time_step(step.h());
  if (options.integrator == Integrator::kRungeKutta4)
    throw InputError("runge_kutta_4 has no inverse: use implicit_midpoint or semi_implicit_euler");
  out.fault = ws.check.of_given(model, q, v, v_next, known);
  if (out.fault.any()) return void_inverse(model, out);
  ws.sleepers.forget();  // what follows overwrites what is known of them
  ws.sleepers.wake_all(model);
  prepare_step(step.context(), ws);
  find_constraints(step, ws);
  const bool refined = refine(step, ws);
  if (refined) compute_body_velocities(model, ws.contact_velocity, ws.data, ws.velocity);
  recover_impulses(model, ws.contact_velocity, step.h(), ws, out);
  out.contact_force = ws.tau / step.h();
  if (options.integrator == Integrator::kSemiImplicitEuler) {
    invert_euler(step, ws, out);
  } else {
    invert_midpoint(step, refined, ws, out);
  }
  if (!ws.free_groups.groups().empty()) {
    integrate_configuration(model, q, ws.contact_velocity, step.h(), ws.q_reached);
    ws.free_groups.restore(step.context(), known, ws.q_reached, v_next, ws.data, ws.body_impulse,
                           out.applied_force);
  }
  out.fault = ws.check.of_recovered(model, out.applied_force);
  out.force_scale = largest_force(ws, out);
}

void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef q_next, VectorRef v_next, const Input& known, Workspace& workspace,
                  Inverse& out) {  // Parameters: what it depends on, one by one
  Workspace::Impl& ws = workspace.impl();
  const EffectSet effects = active_effects(ws.called, options.effects);
  ws.taut_links.set(known.taut_links);
  invert_step({ws.taut_links.slowed(model), options, q, v, q_next, v_next, known, effects}, ws,
              out);
}

}  // namespace counterpoint
