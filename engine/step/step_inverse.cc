#include <algorithm>
#include <limits>

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/forces/drag.h"
#include "counterpoint/engine/forces/driven/closure_switches.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/midpoint.h"
#include "counterpoint/engine/step/step_forces.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Slip velocity of the surface of B over that of A at a contact at the end of the step, across the
/// normal [m/s], from the velocities y of its rows, or of the bodies where it has no tangential
/// rows.
Vector3 slip(const PairConstraint& pair, const double* y, const Kinematics& at,
             const std::vector<Motion>& body_velocity) {
  const Matrix3& frame = pair.frame;
  const contact::Law& law = pair.law;
  if (law.rows >= 3) return y[1] * frame.col(1) + y[2] * frame.col(2);
  const Vector3 v =
      relative_velocity_at(pair.position, pair.body_a, pair.body_b, at, body_velocity);
  return v - v.dot(frame.col(0)) * frame.col(0);
}

/// Evaluates the laws of the pairs at the contact velocity, into pair_velocities and pair_impulses;
/// contacts with friction four at a time.
void evaluate_pairs(const Model& model, const ConstraintSet& constraints, const Kinematics& at,
                    InverseScratch& inverse) {
  size_t rows = 0;
  for (const PairConstraint& pair : constraints.pairs) rows += static_cast<size_t>(pair.law.rows);
  if (inverse.pair_velocities.size() < rows) inverse.pair_velocities.resize(rows);
  if (inverse.pair_impulses.size() < rows) inverse.pair_impulses.resize(rows);
  double* y = inverse.pair_velocities.data();
  double* f = inverse.pair_impulses.data();
  inverse.lanes.clear();
  int row = 0;
  for (const PairConstraint& pair : constraints.pairs) {
    pair_velocity(model, pair, at, inverse.contact_velocity, inverse.chain, y + row);
    if (!inverse.lanes.add(pair.law, 0.0, row, 0)) contact::impulse(pair.law, y + row, f + row);
    row += pair.law.rows;
  }
  inverse.lanes.impulses(y, f);
}

/// J' f of all constraints at the contact velocity, into inverse.tau [N s, N m s]; lists contacts,
/// closures and joint forces in `out`.
void recover_impulses(const Model& model, double h, const ConstraintSet& constraints,
                      const Kinematics& at, InverseScratch& inverse, Inverse& out) {
  inverse.tau.setZero();
  out.contacts.clear();
  out.joints.clear();
  out.tendon_force.setZero(static_cast<Eigen::Index>(model.tendons().size()));
  out.closures.assign(model.closures().size(), {});
  for (Force& f : inverse.body_impulse) {  // per member: a copied zero would wait for its stores
    f.torque.setZero();
    f.force.setZero();
  }
  evaluate_pairs(model, constraints, at, inverse);
  const double* next = inverse.pair_impulses.data();
  const double* y = inverse.pair_velocities.data();
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    const Force impulse = pair_impulse(pair, next);
    add_pair_impulse(pair, impulse, at, inverse.body_impulse);
    if (i < constraints.contacts.size()) {
      ContactForce& contact = out.contacts.emplace_back();
      contact.contact = constraints.contacts[i];
      contact.force = impulse.force / h;  // to the bit as the forward step
      contact.torque = impulse.torque / h;
      contact.slip = slip(pair, y, at, inverse.body_velocity);
    } else {
      ClosureForce& closure =
          out.closures[constraints.closures[i - constraints.contacts.size()].index];
      closure.position = pair.position;
      closure.force += impulse * (1.0 / h);
    }
    next += pair.law.rows;
    y += pair.law.rows;
  }
  project_on_joints(model, at, inverse.body_impulse, inverse.tau);
  for (const JointConstraint& j : constraints.joints) {
    const std::span<const RowTerm> terms = constraints.terms(j);
    const double speed = row_velocity(terms, inverse.contact_velocity) + j.law.bias[0];
    double f = 0.0;
    contact::impulse(j.law, &speed, &f);
    if (j.tendon >= 0) {
      out.tendon_force[j.tendon] += j.along() * f / h;
    } else if (j.actuator < 0) {  // Actuators::conclude reports theirs
      const size_t acts = j.effect == Effect::kLimits ? terms.size() : 1;  // a mimic's follower
      for (const RowTerm& term : terms.first(acts))
        out.joints.push_back({j.effect, term.v_index, term.coefficient * f / h});
    }
    for (const RowTerm& term : terms) inverse.tau[term.v_index] += term.coefficient * f;
  }
}

/// Softens the laws as the forward step did.
void soften_constraints(const Model& model, const Softening& softening, SoftenedTrees& softened,
                        ConstraintSet& constraints) {
  if (!softening.any()) return;
  softened.find(model, constraints, softening);
  for (PairConstraint& pair : constraints.pairs)
    if (softened.holds(model.body(pair.body_a).tree, model.body(pair.body_b).tree))
      pair.law = soften(pair.law, softening);
  for (JointConstraint& row : constraints.joints)
    if (softened.holds(model.tree_of_velocity(constraints.terms(row)[0].v_index), -1))
      row.law = soften(row.law, softening);
}

/// Takes the forces of servos over h [s] at velocities w (nv) out of the applied force.
void subtract_servos(const InverseArguments& step, double h, const VectorRef& w,
                     EffectCounts& counts, Inverse& out) {
  const Model& model = step.model;
  out.servo_force.setZero(static_cast<Eigen::Index>(model.servos().size()));
  if (!step.effects.has(Effect::kServos)) return;
  counts.add(Effect::kServos);
  compute_servo_forces(model, h, step.q, w, step.known, out.servo_force);
  for (size_t i = 0; i < model.servos().size(); ++i)
    out.applied_force[model.body(model.servos()[i].joint + 1).v_index] -= out.servo_force[i];
}

/// Sets all forces to NaN: invalid arguments determine none.
void void_inverse(const Model& model, Inverse& out) {
  out.applied_force.setConstant(model.nv(), kNaN);
  out.contact_force.setConstant(model.nv(), kNaN);
  out.servo_force.setConstant(static_cast<Eigen::Index>(model.servos().size()), kNaN);
  out.force_scale = kNaN;
  out.contacts.clear();
  out.closures.clear();
  out.joints.clear();
  out.tendon_force.setConstant(static_cast<Eigen::Index>(model.tendons().size()), kNaN);
  out.actuator_force.setConstant(static_cast<Eigen::Index>(model.actuators().size()), kNaN);
  out.actuator_wrenches.clear();
  out.z_next.setConstant(model.nz(), kNaN);
}

/// Recovers the applied force u of a semi-implicit step, given out.contact_force.
void invert_euler(const InverseArguments& step, Workspace::Impl& ws, Inverse& out) {
  const double h = step.h();
  const Kinematics& at = ws.start.kinematics();
  InverseScratch& inverse = ws.inverse;
  inverse.acceleration = (step.v_next - step.v) / h;
  set_external(step.known.wrenches, step.effects, ws.taut_links, at, ws.motion.external, ws.counts);
  if (set_drag(step.model, step.effects, h, at, ws.motion.external, ws.counts))
    add_drag_inverse(h, inverse.body_velocity, ws.motion.external);
  rnea(step.model, inverse.acceleration, ws.start.gravity(), ws.bodies(), inverse.tau);
  if (ws.start.velocity_forces().has_coriolis)
    inverse.tau -= ws.start.velocity_forces().mean_rotor_force;
  add_joint_forces_inverse(step.context(), h, step.v_next, inverse.tau, ws.counts);
  out.applied_force = inverse.tau - out.contact_force;
  subtract_servos(step, h, step.v_next, ws.counts, out);
}

/// Relative rounding of the poses that w_c is read off, times the factor by which stiff contacts of
/// light links amplify it (85 on a humanoid). It stays below the steps of numerical derivatives.
constexpr double kPoseRounding = 32768.0 * std::numeric_limits<double>::epsilon();

/// Recovers the applied force u of a step of the midpoint rule (midpoint.h), whose impulses are in
/// the velocities, not in the forces. refined: w_c is as exact as the velocities are.
void invert_midpoint(const InverseArguments& step, bool refined, Workspace::Impl& ws,
                     Inverse& out) {
  const double half = 0.5 * step.h();
  InverseScratch& inverse = ws.inverse;
  VectorX& w_m = ws.midpoint.w_m;
  if (refined) {
    w_m = step.v + step.v_next - inverse.contact_velocity;
  } else {
    find_middle(step, ws, w_m);
  }
  const Vector3 gravity = set_middle(step.context(), w_m, step.known.wrenches, ws);
  inverse.acceleration = (w_m - step.v) / half;
  rnea(step.model, inverse.acceleration, gravity,
       {ws.stage.at, ws.stage.velocity, ws.motion.external, ws.motion.scratch}, inverse.tau);
  add_joint_forces_inverse(step.context(), half, w_m, inverse.tau, ws.counts);
  out.applied_force = inverse.tau;
  subtract_servos(step, half, w_m, ws.counts, out);
  // The reported servo forces are those of the step, at w_c.
  if (step.effects.has(Effect::kServos) && !ws.constraints.empty())
    compute_servo_forces(step.model, half, step.q, inverse.contact_velocity, step.known,
                         out.servo_force);
}

/// Finds the contact velocity (w+, or w_c of the midpoint rule as read off the poses) that the
/// impulses are functions of, the velocities of the bodies at it, and adds to `constraints` those
/// that known input and velocities call for, before softening. Writes `constraints`,
/// inverse.contact_velocity and inverse.body_velocity.
void find_constraints(const InverseArguments& step, const StepStart& start,
                      ConstraintFinder& finder, ConstraintSet& constraints,
                      InverseScratch& inverse) {
  const auto& [model, options, q, v, q_next, v_next, known, effects, z, exact_q_next] = step;
  const bool midpoint = options.integrator == Integrator::kImplicitMidpoint;
  const bool found = !midpoint || q_next.size() > 0;
  inverse.contact_velocity = v_next;
  if (midpoint && found) {
    configuration_difference(model, q, q_next, inverse.contact_velocity);
    inverse.contact_velocity /= options.time_step;
  } else if (midpoint) {
    inverse.contact_velocity = 0.5 * (v + v_next);  // holds without constraints
  }
  if (effects.has(Effect::kTendons))
    add_tendon_servos(step.context(), start.tendons(), known, constraints);
  compute_body_velocities(model, inverse.contact_velocity, start.kinematics(),
                          inverse.body_velocity);
  finder.find_overrun(step.context(), {inverse.contact_velocity, &inverse.body_velocity},
                      start.kinematics(), constraints);
  if (!found && !constraints.empty())
    throw InputError(
        "the inverse of implicit_midpoint needs q at the end of the step where there are "
        "constraints");
}

/// Reports the forces of actuators, and the internal states at the end of the step.
void conclude_states(const InverseArguments& step, Workspace::Impl& ws, Inverse& out) {
  out.z_next = step.z;
  if (!ws.constraints.closures.empty()) break_closures(step.model, out.closures, out.z_next);
  out.actuator_force.setZero(static_cast<Eigen::Index>(step.model.actuators().size()));
  out.actuator_wrenches.clear();
  if (!step.effects.has(Effect::kActuators)) return;
  ws.actuators.conclude(step.context(), ws.start.tendons(), ws.inverse.contact_velocity,
                        out.actuator_force, out.z_next);
  out.actuator_wrenches.assign(ws.actuators.wrenches().begin(), ws.actuators.wrenches().end());
}

double largest_force(const VectorX& tau, const Inverse& out) {
  double largest = 0.0;
  for (const VectorX* force : {&tau, &out.contact_force, &out.applied_force})
    largest = std::max(largest, force->lpNorm<Eigen::Infinity>());
  return largest;
}

}  // namespace

void invert_step(const InverseArguments& given, Workspace::Impl& ws, Inverse& out) {
  const Model& model = given.model;
  InverseScratch& inverse = ws.inverse;
  check_time_step(given.h());
  if (given.options.integrator == Integrator::kRungeKutta4)
    throw InputError("runge_kutta_4 has no inverse: use implicit_midpoint or semi_implicit_euler");
  out.fault = ws.check.of_given(model, given.q, given.v, given.v_next, given.known);
  if (out.fault.any()) return void_inverse(model, out);
  ws.sleepers.forget();  // the memory of sleeping trees is overwritten below
  ws.sleepers.wake_all(model);
  const StepStart& start = prepare_step(given.context(), ws);
  ws.constraints = start.constraints();
  const InverseArguments step = actuate(given, ws);
  find_constraints(step, start, ws.finder, ws.constraints, inverse);
  soften_constraints(model, step.known.softening, ws.solution.softened_trees, ws.constraints);
  // The midpoint rule's w_c from velocities instead of rounded poses, where that is possible.
  const bool rounded = step.options.integrator == Integrator::kImplicitMidpoint &&
                       !ws.constraints.empty() && !step.exact_q_next;
  const bool refined =
      rounded &&
      refine_contact_velocity(step, kPoseRounding * (1.0 + step.q.lpNorm<Eigen::Infinity>()), ws,
                              inverse.contact_velocity);
  if (refined)
    compute_body_velocities(model, inverse.contact_velocity, start.kinematics(),
                            inverse.body_velocity);
  recover_impulses(model, step.h(), ws.constraints, start.kinematics(), inverse, out);
  out.contact_force = inverse.tau / step.h();
  if (step.options.integrator == Integrator::kSemiImplicitEuler) {
    invert_euler(step, ws, out);
  } else {
    invert_midpoint(step, refined, ws, out);
  }
  if (!ws.free_groups.groups().empty()) {
    integrate_configuration(model, step.q, inverse.contact_velocity, step.h(), ws.q_reached);
    // The forces act at q, or at the middle of the midpoint rule.
    const bool midpoint = step.options.integrator == Integrator::kImplicitMidpoint;
    ws.free_groups.restore(step.context(), step.known, ws.q_reached, step.v_next,
                           midpoint ? ws.stage.at : start.kinematics(), inverse.body_impulse,
                           out.applied_force);
  }
  conclude_states(step, ws, out);
  out.fault = ws.check.of_recovered(model, out.applied_force);
  out.force_scale = largest_force(inverse.tau, out);
}

Vector3 contact_force_on(const Model& model, const Inverse& inverse, int body) {
  Vector3 sum = Vector3::Zero();
  for (const ContactForce& one : inverse.contacts) {
    if (model.geometries()[one.contact.geometry_b].body == body) sum += one.force;
    if (model.geometries()[one.contact.geometry_a].body == body) sum -= one.force;
  }
  return sum;
}

void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef q_next, VectorRef v_next, const Input& known, Workspace& workspace,
                  Inverse& out) {
  Workspace::Impl& ws = workspace.impl();
  const EffectSet effects = active_effects(ws.called, options.effects);
  ws.taut_links.set(known.taut_links);
  const VectorX& z = set_internal_states(model, effects, q, known.z, known, ws);
  invert_step({ws.taut_links.slowed(model), options, q, v, q_next, v_next, known, effects, z}, ws,
              out);
}

}  // namespace counterpoint
