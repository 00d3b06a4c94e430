#include "counterpoint/engine/step.h"

#include <limits>
#include <span>
#include <string>

#include "counterpoint/contact/law.h"
#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/assemble.h"
#include "counterpoint/engine/culprit.h"
#include "counterpoint/engine/drag.h"
#include "counterpoint/engine/effort_limits.h"
#include "counterpoint/engine/fast_trees.h"
#include "counterpoint/engine/free_flight.h"
#include "counterpoint/engine/integrator.h"
#include "counterpoint/engine/joint_forces.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/engine/rnea.h"
#include "counterpoint/engine/servos.h"
#include "counterpoint/engine/sleep.h"
#include "counterpoint/engine/springs.h"
#include "counterpoint/engine/state_check.h"

namespace counterpoint {

struct Workspace::Impl {
  explicit Impl(const Model& model)
      : check(model),
        data(model),
        finder(model, compute_inverse_weights(model, data)),
        sleepers(model),
        free_flight(model),
        fast_trees(model),
        velocity(model.num_bodies()),
        body_impulse(model.num_bodies()),
        velocity_acceleration(model.drags().empty() ? 0 : model.num_bodies()),
        tau(VectorX::Zero(model.nv())),
        diagonal(VectorX::Zero(model.nv())),
        acceleration(VectorX::Zero(model.nv())),
        no_rotors(VectorX::Zero(model.nv())),
        called(called_for(model, finder.collider())) {}

  StateCheck check;
  Data data;
  ConstraintFinder finder;
  ConstraintSet constraints;

  // forward
  Sleepers sleepers;
  FreeFlight free_flight;
  FastTrees fast_trees;
  std::vector<int> block_of_tree;
  contact::Problem problem;
  contact::Solver solver;
  // Grown only: Eigen allocates whenever a size changes.
  VectorX w;        ///< velocities of the touched trees, as the problem orders them, then unused
  VectorX impulse;  ///< of all constraints, then unused

  // inverse
  std::vector<Motion> velocity;  ///< V at v_next
  std::vector<Force> body_impulse;

  std::vector<Motion> velocity_acceleration;  ///< scratch of drag
  VectorX tau, diagonal, acceleration, no_rotors;
  EffectSet called;  ///< what the model calls for
  EffectCounts counts;
};

Workspace::Workspace(const Model& model) : impl_(std::make_unique<Impl>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

const EffectCounts& Workspace::effect_counts() const { return impl_->counts; }

namespace {

void clear_external(Data& data) {
  data.has_external = true;
  for (Force& f : data.external) f = Force();
}

void set_external(const std::vector<ExternalWrench>& wrenches, EffectSet effects,
                  Workspace::Impl& ws) {
  Data& data = ws.data;
  data.has_external = effects.has(Effect::kExternalWrenches) && !wrenches.empty();
  if (!data.has_external) return;
  ws.counts.add(Effect::kExternalWrenches);
  clear_external(data);
  for (const ExternalWrench& w : wrenches) {
    const Vector3 arm = data.X_WB[w.body].rotation * w.point;
    data.external[w.body] += Force{w.wrench.torque + arm.cross(w.wrench.force), w.wrench.force};
  }
}

/// h C of all drag (drag.h), with data.external ready for its forces. False if there is none.
bool set_drag(const Model& model, EffectSet effects, double h, Workspace::Impl& ws) {
  ws.data.added.clear();
  if (!effects.has(Effect::kDrag)) return false;
  ws.counts.add(Effect::kDrag);
  compute_drag(model, h, ws.data);
  if (!ws.data.has_external) clear_external(ws.data);
  return true;
}

/// Velocity-dependent forces and gravity as far as they are on. Before any dynamics, after
/// everything that needs the accelerations at constant joint velocities as they are.
Vector3 set_body_forces(const Model& model, EffectSet effects, double h, const VectorRef& q,
                        const VectorRef& v, std::span<const BodyRange> ranges,
                        Workspace::Impl& ws) {
  Vector3 gravity = Vector3::Zero();
  if (effects.has(Effect::kGravity)) {
    ws.counts.add(Effect::kGravity);
    gravity = model.gravity();
  }
  ws.data.has_coriolis = effects.has(Effect::kCoriolis);
  if (ws.data.has_coriolis) {
    ws.counts.add(Effect::kCoriolis);
    const VectorX& rotors = effects.has(Effect::kArmature) ? model.armature() : ws.no_rotors;
    for (const BodyRange& bodies : ranges) {
      ws.free_flight.apply(model, h, v, gravity, bodies, ws.data);
      ws.fast_trees.apply(model, h, q, v, rotors, bodies, ws.data);
    }
  } else {
    for (Motion& c : ws.data.c) c = Motion();
  }
  return gravity;
}

struct VelocityRange {
  int begin, size;
};

VelocityRange velocities(const Model& model, BodyRange bodies) {
  const int begin = model.body(bodies.begin).v_index;
  const Body& last = model.body(bodies.end - 1);
  return {begin, last.v_index + joint_nv(last.joint_type) - begin};
}

void compute_kinematics(const Model& model, const State& state,
                        const std::vector<BodyRange>& ranges, Data& data) {
  for (const BodyRange& bodies : ranges) {
    compute_poses(model, state.q, bodies, data);
    compute_velocities(model, state.v, bodies, data);
    compute_inertias(model, bodies, data);
  }
}

/// The constraints of all that is awake, after all are awake that these touch.
void find_constraints(const Model& model, const SimulationOptions& options, EffectSet effects,
                      const State& state, Workspace::Impl& ws) {
  if (ws.sleepers.awake().empty()) return ws.constraints.clear();
  compute_kinematics(model, state, ws.sleepers.awake(), ws.data);
  const auto find = [&] {
    ws.finder.find(model, options, effects, state.q, state.v, ws.data, ws.constraints, ws.counts,
                   ws.sleepers.idle_bodies());
  };
  find();
  while (ws.sleepers.wake_touched(model, ws.constraints)) {
    compute_kinematics(model, state, ws.sleepers.woken(), ws.data);
    find();
  }
}

/// Applied forces, as far as motors can give them, and servos: into tau and diagonal; servos that
/// can be at their limit become rows.
void set_motor_forces(const Model& model, EffectSet effects, double h, const State& state,
                      const Input& input, Workspace::Impl& ws) {
  ws.tau.setZero();
  ws.diagonal.setZero();
  if (effects.has(Effect::kAppliedForces) && input.applied_force.size() > 0) {
    ws.counts.add(Effect::kAppliedForces);
    ws.tau = input.applied_force;
  }
  if (effects.has(Effect::kServos)) {
    ws.counts.add(Effect::kServos);
    add_servo_rows(model, effects, h, state.q, input, ws.sleepers.idle_bodies(), ws.tau,
                   ws.constraints.joints);
  }
  if (effects.has(Effect::kEffortLimits)) {
    ws.counts.add(Effect::kEffortLimits);
    limit_applied_forces(model, effects, ws.tau);
  }
  if (effects.has(Effect::kServos))
    add_servos(model, effects, h, state.q, state.v, input, ws.diagonal, ws.tau);
}

/// w* = w + h inv(M + diagonal) (n + u - ...): the velocity if there were no constraint.
void compute_free_velocity(const Model& model, EffectSet effects, double h, const State& state,
                           const Input& input, Workspace::Impl& ws, VectorX& w_free,
                           StepReport& report) {
  set_motor_forces(model, effects, h, state, input, ws);
  add_joint_forces(model, effects, h, state.q, state.v, ws.diagonal, ws.tau, ws.counts);
  set_external(input.wrenches, effects, ws);
  const Vector3 gravity =
      set_body_forces(model, effects, h, state.q, state.v, ws.sleepers.awake(), ws);
  if (ws.data.has_coriolis) ws.tau += ws.data.mean_rotor_force;
  if (set_drag(model, effects, h, ws))
    add_drag(model, h, gravity, ws.velocity_acceleration, ws.data);
  w_free = state.v;
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

void grow(VectorX& v, int size) {
  if (v.size() < size) v.resize(size);
}

/// Replaces the velocities of the touched trees by the solution of the contact problem.
void solve_constraints(const Model& model, const contact::Settings& settings, const State& state,
                       Workspace::Impl& ws, VectorX& w, StepReport& report) {
  assemble_problem(model, ws.constraints, w, ws.diagonal, ws.data, ws.block_of_tree, ws.problem);
  grow(ws.w, ws.problem.num_velocities());
  grow(ws.impulse, ws.problem.num_rows());
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = ws.block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    ws.w.segment(ws.problem.block_start(block), ws.problem.block_size(block)) =
        state.v.segment(tree.v_begin, tree.v_end - tree.v_begin);
  }
  const contact::Report& solved =
      ws.solver.solve(ws.problem, settings, ws.w.head(ws.problem.num_velocities()),
                      Eigen::Ref<VectorX>(ws.impulse.head(ws.problem.num_rows())));
  report.status = solved.status;
  report.newton_iterations = solved.iterations;
  report.residual = solved.residual;
  if (!report.succeeded()) {
    report.fault = solver_fault(model, report.status, ws.constraints, ws.problem, ws.block_of_tree,
                                ws.w.head(ws.problem.num_velocities()),
                                ws.impulse.head(ws.problem.num_rows()));
  }
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = ws.block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    w.segment(tree.v_begin, tree.v_end - tree.v_begin) =
        ws.w.segment(ws.problem.block_start(block), ws.problem.block_size(block));
  }
}

void integrate(const Model& model, double h, const State& state, Workspace::Impl& ws, State& next) {
  next.q = state.q;
  next.time = state.time + h;
  for (const BodyRange& bodies : ws.sleepers.awake())
    integrate_configuration(model, state.q, next.v, h, bodies, next.q);
  if (ws.constraints.empty()) return;
  ws.sleepers.hold_still(model, h, ws.finder.radii(), ws.data, state, next);
}

contact::Status status_of(const Fault& fault) {
  if (fault.kind == FaultKind::kQuaternion) return contact::Status::kInvalidState;
  if (fault.kind == FaultKind::kSpeed) return contact::Status::kDiverged;
  return contact::Status::kNotFinite;
}

void check_time_step(double h) {
  if (!(h > 0.0 && h < std::numeric_limits<double>::infinity()))
    throw InputError("the time step of a step must be positive, it is " + std::to_string(h) + " s");
}

/// What a step was given goes before what came of it.
void blame_given(const Model& model, const State& state, const Input& input, Workspace::Impl& ws,
                 StepReport& report) {
  const Fault given = ws.check.of_given(model, state, input);
  if (!given.any()) return;
  report.fault = given;
  report.status = status_of(given);
}

/// Looks at what came out of a step.
void check_result(const Model& model, const SimulationOptions& options, const State& state,
                  const Input& input, const State& next, Workspace::Impl& ws, StepReport& report) {
  if (ws.check.accepts(options.max_speed, next)) return;
  report.fault = ws.check.of_result(model, options.max_speed, next);
  report.status = status_of(report.fault);
  if (report.fault.kind != FaultKind::kSpeed) return;
  const double reach = ws.check.reach()[static_cast<size_t>(report.fault.coordinate)];
  report.fault.cause = speed_cause(model, options.time_step, report.fault, reach, state, input,
                                   next, ws.data, ws.velocity);
}

}  // namespace

StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace, State& next) {
  Workspace::Impl& ws = workspace.impl();
  const double h = options.time_step;
  const EffectSet effects = active_effects(ws.called, options.effects);
  StepReport report;
  check_time_step(h);
  if (!ws.check.accepts(model, state, input, effects.has(Effect::kContacts))) {
    blame_given(model, state, input, ws, report);
    return report;
  }
  if (effects.has(Effect::kSleeping)) {
    ws.counts.add(Effect::kSleeping);
    ws.sleepers.begin(model, options, settings, state, input);
  } else {
    ws.sleepers.wake_all(model);
  }
  find_constraints(model, options, effects, state, ws);
  compute_free_velocity(model, effects, h, state, input, ws, next.v, report);
  if (report.succeeded() && !ws.constraints.empty())
    solve_constraints(model, settings, state, ws, next.v, report);
  ws.sleepers.find_islands(model, ws.constraints);
  integrate(model, h, state, ws, next);
  if (report.succeeded()) check_result(model, options, state, input, next, ws, report);
  if (!report.succeeded()) blame_given(model, state, input, ws, report);
  report.contacts = static_cast<int>(ws.constraints.contacts.size());
  report.constraint_rows = ws.constraints.empty() ? 0 : ws.problem.num_rows();
  report.sleeping_bodies = ws.sleepers.num_sleeping_bodies();
  report.max_penetration = std::max(ws.constraints.max_penetration, ws.sleepers.max_penetration());
  if (effects.has(Effect::kSleeping) && report.succeeded()) {
    ws.sleepers.end(model, state, input, ws.constraints, next);
  } else {
    ws.sleepers.forget();
  }
  return report;
}

namespace {

/// J' f of all constraints at the velocity v_next, into ws.tau [N s]; contacts and closures listed
/// in `out`.
void recover_impulses(const Model& model, const VectorRef& v_next, double h, Workspace::Impl& ws,
                      Inverse& out) {
  compute_body_velocities(model, v_next, ws.data, ws.velocity);
  ws.tau.setZero();
  out.contacts.clear();
  out.closures.assign(model.closures().size(), {});
  for (Force& f : ws.body_impulse) f = Force();
  const ConstraintSet& constraints = ws.constraints;
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    contact::Rows y = relative_velocity(pair, ws.data, ws.velocity);
    for (int row = 0; row < pair.law.rows; ++row) y[row] += pair.law.bias[row];
    const Force impulse = pair_impulse(pair, contact::impulse(pair.law, y));
    add_pair_impulse(pair, impulse, ws.data, ws.body_impulse);
    if (i < constraints.contacts.size()) {
      out.contacts.push_back({constraints.contacts[i], impulse.force / h});
    } else {
      ClosureForce& closure = out.closures[constraints.closures[i - constraints.contacts.size()]];
      closure.position = pair.position;
      closure.force += impulse * (1.0 / h);
    }
  }
  project_on_joints(model, ws.data, ws.body_impulse, ws.tau);
  for (const JointConstraint& j : ws.constraints.joints) {
    contact::Rows y(1);
    y[0] = j.coefficient[0] * v_next[j.v_index[0]] + j.law.bias[0];
    if (j.v_index[1] >= 0) y[0] += j.coefficient[1] * v_next[j.v_index[1]];
    const double f = contact::impulse(j.law, y)[0];
    for (int k = 0; k < 2; ++k)
      if (j.v_index[k] >= 0) ws.tau[j.v_index[k]] += j.coefficient[k] * f;
  }
}

/// What is left of the applied force when the servos' share is taken out.
void subtract_servos(const Model& model, EffectSet effects, double h, const VectorRef& q,
                     const VectorRef& v_next, const Input& known, Workspace::Impl& ws,
                     Inverse& out) {
  out.servo_force.setZero(static_cast<Eigen::Index>(model.servos().size()));
  if (!effects.has(Effect::kServos)) return;
  ws.counts.add(Effect::kServos);
  compute_servo_forces(model, h, q, v_next, known, out.servo_force);
  for (size_t i = 0; i < model.servos().size(); ++i)
    out.applied_force[model.body(model.servos()[i].joint + 1).v_index] -= out.servo_force[i];
}

/// What is not known is not a number.
void void_inverse(const Model& model, Inverse& out) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  out.applied_force.setConstant(model.nv(), kNaN);
  out.contact_force.setConstant(model.nv(), kNaN);
  out.servo_force.setConstant(static_cast<Eigen::Index>(model.servos().size()), kNaN);
  out.force_scale = kNaN;
  out.contacts.clear();
  out.closures.clear();
}

}  // namespace

void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef v_next, const Input& known, Workspace& workspace, Inverse& out) {
  Workspace::Impl& ws = workspace.impl();
  const double h = options.time_step;
  const EffectSet effects = active_effects(ws.called, options.effects);
  check_time_step(h);
  out.fault = ws.check.of_given(model, q, v, v_next, known);
  if (out.fault.any()) return void_inverse(model, out);
  ws.sleepers.forget();  // what follows overwrites what is known of them
  compute_poses(model, q, ws.data);
  compute_velocities(model, v, ws.data);
  ws.finder.find(model, options, effects, q, v, ws.data, ws.constraints, ws.counts);
  recover_impulses(model, v_next, h, ws, out);
  out.contact_force = ws.tau / h;

  ws.acceleration = (v_next - v) / h;
  set_external(known.wrenches, effects, ws);
  const BodyRange all = moving_bodies(model);
  const Vector3 gravity = set_body_forces(model, effects, h, q, v, {&all, 1}, ws);
  if (set_drag(model, effects, h, ws)) add_drag_inverse(h, ws.velocity, ws.data);
  rnea(model, ws.acceleration, gravity, ws.data, ws.tau);
  if (ws.data.has_coriolis) ws.tau -= ws.data.mean_rotor_force;
  add_joint_forces_inverse(model, effects, h, q, v, v_next, ws.tau, ws.counts);
  out.applied_force = ws.tau - out.contact_force;
  subtract_servos(model, effects, h, q, v_next, known, ws, out);
  out.fault = ws.check.of_recovered(model, out.applied_force);
  out.force_scale = 0.0;
  for (const VectorX* force : {&ws.tau, &out.contact_force, &out.applied_force})
    out.force_scale = std::max(out.force_scale, force->size() ? force->cwiseAbs().maxCoeff() : 0.0);
}

}  // namespace counterpoint
