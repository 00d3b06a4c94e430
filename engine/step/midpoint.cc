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

// Converges by about h omega / 2 an iteration; ends when rounding is all that is left.
constexpr int kMaxIterations = 60;
constexpr double kSettled = 1e-15, kArrived = 1e-11;

/// A servo with an effort limit is a row whose law is that of a backward Euler step.
void refuse_limited_servos(const Model& model, EffectSet effects) {
  if (!effects.has(Effect::kServos)) return;
  for (const JointServo& servo : model.servos()) {
    if (!is_limited(model, effects, servo)) continue;
    throw InputError("joint '" + model.joint(servo.joint).name +
                     "': a servo with an effort limit cannot be integrated by implicit_midpoint; "
                     "use semi_implicit_euler, or switch effort_limits off");
  }
}

/// I + h D from the I + (h / 2) D of the first half of the rule: rotors and joints' own forces over
/// the whole step, in ws.diagonal.
void widen_diagonal(const Model& model, EffectSet effects, Workspace::Impl& ws) {
  ws.diagonal = 2.0 * ws.diagonal - rotor_inertia(model, effects, ws);
}

/// Iterates to w_m, from `middle` on. Joints' own forces are implicit in it as in a backward Euler
/// step of h / 2, which is the first half of the midpoint rule.
void solve_middle(const StepArguments& step, Workspace::Impl& ws, VectorX& middle,
                  StepReport& report) {
  const auto& [model, options, settings, state, input, effects] = step;
  const StepContext at = step.context();
  const double half = 0.5 * step.h();
  set_motor_forces(at, half, input, ws);
  add_joint_forces(at, half, ws.diagonal, ws.tau, ws.counts);
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxIterations; ++i) {
    const Vector3 gravity = set_middle(at, middle, input.wrenches, ws);
    accelerate(model, half, gravity, state.v, ws, ws.next_middle, report);
    if (!report.succeeded()) return;
    const double size = ws.next_middle.lpNorm<Eigen::Infinity>();
    const double change = (ws.next_middle - middle).lpNorm<Eigen::Infinity>();
    middle.swap(ws.next_middle);
    // Rounding keeps it from falling further.
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
  ws.other = middle + ws.start.predictor().change_by_equalities();
  integrate_configuration(at.model, at.q, ws.other, 0.5 * at.h(), ws.q_middle);
  return set_forces_at(at.model, at.effects, ws.q_middle, ws.other, wrenches, ws);
}

void step_midpoint(const StepArguments& step, Workspace::Impl& ws, State& next,
                   StepReport& report) {
  const auto& [model, options, settings, state, input, effects] = step;
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
  ws.middle = next.v;
  // Of limits only: no contacts are parked under this rule, so ws.data, which holds the middle, is
  // not read.
  if (!ws.constraints.empty() ||
      ws.finder.find_overrun(step.context(), {next.v}, ws.data, ws.constraints)) {
    const BodyRange all = moving_bodies(model);
    compute_kinematics(model, state.q, state.v, {&all, 1}, ws.data);
    widen_diagonal(model, effects, ws);
    solve_constraints(step, ws, next.v, report);
  }
  integrate_configuration(model, state.q, next.v, h, next.q);
  next.v += ws.middle - state.v;
  if (report.succeeded()) ws.free_groups.correct(step.context(), input, next.q, next);
}

namespace {

/// I + h D less I of the whole step into ws.diagonal, inertias into ws.data.
void prepare_mass(const InverseArguments& step, Workspace::Impl& ws) {
  const Model& model = step.model;
  const StepContext at = step.context();
  const double half = 0.5 * step.h();
  ws.diagonal.setZero();
  VectorX& forces = ws.not_wanted;
  forces.setZero(model.nv());
  if (step.effects.has(Effect::kServos)) add_servos(at, half, step.known, ws.diagonal, forces);
  add_joint_forces(at, half, ws.diagonal, forces, ws.counts);
  widen_diagonal(model, step.effects, ws);
  compute_inertias(model, ws.data);
}

}  // namespace

bool refine_contact_velocity(const InverseArguments& step, double pose_rounding,
                             Workspace::Impl& ws, VectorX& w_c) {
  const Model& model = step.model;
  prepare_mass(step, ws);
  ws.middle = 0.5 * (step.v + step.v_next);
  contact::Problem& problem = ws.problem;
  assemble_problem(model, ws.constraints, ws.middle, ws.diagonal, ws.data, ws.block_of_tree,
                   problem);
  if (ws.w.size() < problem.num_velocities()) ws.w.resize(problem.num_velocities());
  if (ws.impulse.size() < problem.num_rows()) ws.impulse.resize(problem.num_rows());
  const auto for_each_block = [&](auto visit) {
    for (int t = 0; t < model.num_trees(); ++t) {
      const int block = ws.block_of_tree[static_cast<size_t>(t)];
      if (block < 0) continue;
      const int size = problem.block_size(block);
      visit(block, Eigen::seqN(model.trees()[static_cast<size_t>(t)].v_begin, size),
            Eigen::seqN(problem.block_start(block), size));
    }
  };
  for_each_block([&](int block, auto in_tree, auto in_block) {
    problem.mass(block) *= 2.0;
    ws.w(in_block) = w_c(in_tree);
  });
  contact::Settings settings;
  settings.only = contact::Method::kVelocity;  // from where it starts, no other solution
  settings.soften_after = 0;
  settings.max_iterations = 20;
  const contact::Report& report =
      ws.solver.solve(problem, settings, ws.w.head(problem.num_velocities()),
                      Eigen::Ref<VectorX>(ws.impulse.head(problem.num_rows())));
  if (!contact::succeeded(report.status)) return false;
  for_each_block([&](int, auto in_tree, auto in_block) { ws.middle(in_tree) = ws.w(in_block); });
  // The poses of free groups hold a displacement of all of a group beside w_c.
  for (const FreeGroups::Group& group : ws.free_groups.groups())
    for (const int t : group.trees) {
      const int v_begin = model.trees()[static_cast<size_t>(t)].v_begin;
      w_c.segment<3>(v_begin) = ws.middle.segment<3>(v_begin);
    }
  if (!((ws.middle - w_c).lpNorm<Eigen::Infinity>() * step.h() <= pose_rounding)) return false;
  w_c.swap(ws.middle);
  return true;
}

void find_middle(const InverseArguments& step, Workspace::Impl& ws, VectorX& middle) {
  const Model& model = step.model;
  middle = 0.5 * (step.v + step.v_next);
  if (ws.constraints.empty()) return;
  prepare_mass(step, ws);
  Data& data = ws.data;
  data.has_coriolis = data.has_external = false;
  data.added.clear();
  for (Motion& c : data.c) c = Motion();
  // A singular M would have stopped the step that is inverted.
  if (!aba(model, ws.tau, ws.diagonal, Vector3::Zero(), moving_bodies(model), data,
           ws.acceleration))
    return;
  middle -= 0.5 * ws.acceleration;
}

}  // namespace counterpoint
