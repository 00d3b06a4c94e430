#include "counterpoint/engine/step/midpoint.h"

#include <algorithm>
#include <limits>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/step_constraints.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
namespace {

/// The iteration contracts by about h omega / 2, and ends when only rounding is left: at a relative
/// change of kSettled, or when a change below kArrived stops falling.
constexpr int kMaxIterations = 60;
constexpr double kSettled = 1e-15, kArrived = 1e-11;

/// Refuses servos with effort limits: their rows have the law of a backward Euler step.
void refuse_limited_servos(const Model& model, EffectSet effects) {
  if (!effects.has(Effect::kServos)) return;
  for (const JointServo& servo : model.servos()) {
    if (!is_limited(model, effects, servo)) continue;
    throw InputError("joint '" + model.joint(servo.joint).name +
                     "': a servo with an effort limit cannot be integrated by implicit_midpoint; "
                     "use semi_implicit_euler, or switch effort_limits off");
  }
}

/// Turns I + (h / 2) D of the first half of the rule into I + h D: rotor inertia, and the joints'
/// own forces over the whole step.
void widen_diagonal(const VectorX& rotor_inertia, VectorX& diagonal) {
  diagonal = 2.0 * diagonal - rotor_inertia;
}

/// Iterates to w_m, starting from `middle`. The joints' own forces are implicit in it as in a
/// backward Euler step of h / 2, which is the first half of the midpoint rule.
void solve_middle(const StepArguments& step, Workspace::Impl& ws, VectorX& middle,
                  StepReport& report) {
  const auto& [model, options, settings, state, input, effects, z] = step;
  const StepContext at = step.context();
  const double half = 0.5 * step.h();
  CoordinateForces& forces = ws.motion.forces;
  VectorX& next_middle = ws.midpoint.next_w_m;
  set_motor_forces(at, half, input, ws.sleepers.sleep_mask(), forces, ws.constraints, ws.counts);
  add_joint_forces(at, half, forces.diagonal, forces.tau, ws.counts);
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxIterations; ++i) {
    const Vector3 gravity = set_middle(at, middle, input.wrenches, ws);
    accelerate(model, half, gravity, state.v, ws.sleepers.awake(), ws.pool.get(), ws.stage.at,
               ws.stage.velocity, ws.motion, next_middle, report);
    if (!report.succeeded()) return;
    const double size = next_middle.lpNorm<Eigen::Infinity>();
    const double change = (next_middle - middle).lpNorm<Eigen::Infinity>();
    middle.swap(next_middle);
    if (change <= kSettled * size || (change <= kArrived * size && change >= last)) return;
    last = change;
  }
  report.status = contact::Status::kNoProgress;
  report.fault.kind = FaultKind::kUnsolved;
  report.residual = last;
}

}  // namespace

Vector3 set_middle(const StepContext& at, const VectorRef& middle,
                   const std::vector<ExternalWrench>& wrenches, Workspace::Impl& ws) {
  MidpointVelocities& midpoint = ws.midpoint;
  midpoint.at_w = middle + ws.start.predictor().change_by_equalities();
  integrate_configuration(at.model, at.q, midpoint.at_w, 0.5 * at.h(), midpoint.at_q);
  return set_forces_at(at.model, at.effects, midpoint.at_q, midpoint.at_w, wrenches, ws.taut_links,
                       ws.stage, ws.motion.external, ws.counts);
}

void step_midpoint(const StepArguments& step, Workspace::Impl& ws, State& next,
                   StepReport& report) {
  const auto& [model, options, settings, state, input, effects, z] = step;
  const double h = step.h();
  refuse_limited_servos(model, effects);
  {
    const PhaseTimer timer(ws.times, &PhaseTimes::dynamics);
    next.v = state.v;
    solve_middle(step, ws, next.v, report);
  }
  next.q = state.q;
  next.time = state.time + h;
  if (!report.succeeded()) return;
  ws.midpoint.w_m = next.v;
  // Limits alone can be overrun: no contacts are parked under this rule.
  if (!ws.constraints.empty() ||
      ws.finder.find_overrun(step.context(), {next.v}, ws.start.kinematics(), ws.constraints)) {
    const PhaseTimer timer(ws.times, &PhaseTimes::constraints);
    ws.start.find_inertias(model);
    widen_diagonal(ws.start.rotor_inertia(model, effects), ws.motion.forces.diagonal);
    const StageInput in{step,      ws.start, ws.sleepers,  ws.taut_links,
                        ws.counts, nullptr,  ws.pool.get()};
    ConstraintStage(in, ws.motion, ws.finder, ws.constraints, ws.solution, report).solve(next.v);
  }
  integrate_configuration(model, state.q, next.v, h, next.q);
  ws.midpoint.w_c = next.v;
  next.v += ws.midpoint.w_m - state.v;
  if (report.succeeded()) ws.free_groups.correct(step.context(), input, next.q, next);
}

namespace {

/// Sets `diagonal` (nv) to I + h D of the step that is inverted, with I the rotor inertia.
/// discarded: scratch.
void set_diagonal(const InverseArguments& step, const StepStart& start, VectorX& diagonal,
                  VectorX& discarded, EffectCounts& counts) {
  const StepContext at = step.context();
  const double half = 0.5 * step.h();
  diagonal.setZero();
  discarded.setZero(step.model.nv());
  if (step.effects.has(Effect::kServos)) add_servos(at, half, step.known, diagonal, discarded);
  add_joint_forces(at, half, diagonal, discarded, counts);
  widen_diagonal(start.rotor_inertia(step.model, step.effects), diagonal);
}

}  // namespace

bool refine_contact_velocity(const InverseArguments& step, double pose_rounding,
                             Workspace::Impl& ws, VectorX& w_c) {
  const Model& model = step.model;
  VectorX& refined = ws.midpoint.w_m;
  ContactSolution& solution = ws.solution;
  contact::Problem& problem = solution.problem;
  set_diagonal(step, ws.start, ws.motion.forces.diagonal, ws.inverse.discarded, ws.counts);
  ws.start.find_inertias(model);
  refined = 0.5 * (step.v + step.v_next);
  assemble_problem(model, ws.constraints, refined, ws.motion.forces.diagonal, ws.bodies(),
                   solution.block_of_tree, problem);
  solution.grow();
  for (int block = 0; block < problem.num_blocks(); ++block) problem.mass(block) *= 2.0;
  for_each_touched(model, solution, [&](auto in_tree, auto in_block) {
    solution.velocity(in_block) = w_c(in_tree);
  });
  contact::Settings settings;
  settings.only = contact::Method::kVelocity;  // stays at the solution next to the start
  settings.soften_after = 0;
  settings.max_iterations = 20;
  const contact::Report& report =
      solution.solver.solve(problem, settings, solution.velocities(), solution.impulses());
  if (!contact::succeeded(report.status)) return false;
  for_each_touched(model, solution, [&](auto in_tree, auto in_block) {
    refined(in_tree) = solution.velocity(in_block);
  });
  // The poses of a free group hold a displacement of the whole group beside w_c.
  for (const FreeGroups::Group& group : ws.free_groups.groups())
    for (const int t : group.trees) {
      const int v_begin = model.trees()[static_cast<size_t>(t)].v_begin;
      w_c.segment<3>(v_begin) = refined.segment<3>(v_begin);
    }
  if (!((refined - w_c).lpNorm<Eigen::Infinity>() * step.h() <= pose_rounding)) return false;
  w_c.swap(refined);
  return true;
}

void find_middle(const InverseArguments& step, Workspace::Impl& ws, VectorX& middle) {
  const Model& model = step.model;
  middle = 0.5 * (step.v + step.v_next);
  if (ws.constraints.empty()) return;
  set_diagonal(step, ws.start, ws.motion.forces.diagonal, ws.inverse.discarded, ws.counts);
  ws.start.find_inertias(model);
  ExternalForces& external = ws.motion.external;
  external.has_external = false;
  external.added.clear();
  // A singular M would have stopped the step that is inverted.
  if (!aba(model, ws.inverse.tau, ws.motion.forces.diagonal, Vector3::Zero(), moving_bodies(model),
           {ws.start.kinematics(), ws.no_velocity_forces, external, ws.motion.scratch},
           ws.inverse.acceleration))
    return;
  middle -= 0.5 * ws.inverse.acceleration;
}

}  // namespace counterpoint
