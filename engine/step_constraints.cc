#include "counterpoint/engine/step_constraints.h"

#include "counterpoint/engine/culprit.h"
#include "counterpoint/engine/step_forces.h"

namespace counterpoint {
namespace {

void grow(VectorX& v, int size) {
  if (v.size() < size) v.resize(size);
}

/// Calls visit(of_tree, of_block) for the velocities of every tree that constraints touch: where
/// they are among the model's, and among the problem's.
template <class Visit>
void for_each_touched(const Model& model, const Workspace::Impl& ws, Visit visit) {
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = ws.block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    visit(Eigen::seqN(tree.v_begin, size), Eigen::seqN(ws.problem.block_start(block), size));
  }
}

void report_failure(const Model& model, const contact::Problem& problem, const VectorRef& w,
                    const VectorRef& impulse, Workspace::Impl& ws, StepReport& report) {
  if (report.succeeded()) return;
  report.fault =
      solver_fault(model, report.status, ws.constraints, problem, ws.block_of_tree, w, impulse);
}

/// Replaces the velocities of the touched trees in w (nv), those without constraints, by the
/// solution of the contact problem.
void solve_found(const Model& model, const contact::Settings& settings, const State& state,
                 Workspace::Impl& ws, VectorX& w, StepReport& report) {
  assemble_problem(model, ws.constraints, w, ws.diagonal, ws.data, ws.block_of_tree, ws.problem);
  grow(ws.w, ws.problem.num_velocities());
  grow(ws.impulse, ws.problem.num_rows());
  for_each_touched(model, ws,
                   [&](auto in_tree, auto in_block) { ws.w(in_block) = state.v(in_tree); });
  Eigen::Ref<VectorX> solution = ws.w.head(ws.problem.num_velocities());
  Eigen::Ref<VectorX> impulse = ws.impulse.head(ws.problem.num_rows());
  const contact::Report& solved = ws.solver.solve(ws.problem, settings, solution, impulse);
  report.status = solved.status;
  report.newton_iterations += solved.iterations;
  report.residual = solved.residual;
  report_failure(model, ws.problem, solution, impulse, ws, report);
  for_each_touched(model, ws, [&](auto in_tree, auto in_block) { w(in_tree) = ws.w(in_block); });
}

}  // namespace

void find_constraints(const Model& model, const SimulationOptions& options, EffectSet effects,
                      const State& state, Workspace::Impl& ws) {
  if (ws.sleepers.awake().empty()) return ws.constraints.clear();
  compute_kinematics(model, state.q, state.v, ws.sleepers.awake(), ws.data);
  const auto find = [&] {
    ws.finder.find(model, options, effects, state.q, state.v, ws.data, ws.constraints, ws.counts,
                   ws.sleepers.idle_bodies());
  };
  find();
  while (ws.sleepers.wake_touched(model, ws.constraints)) {
    compute_kinematics(model, state.q, state.v, ws.sleepers.woken(), ws.data);
    find();
  }
}

void solve_constraints(const Model& model, const SimulationOptions& options, EffectSet effects,
                       const contact::Settings& settings, const State& state, Workspace::Impl& ws,
                       VectorX& w, StepReport& report) {
  bool solved = !ws.constraints.empty();
  if (solved) solve_found(model, settings, state, ws, w, report);
  // Each time a row more, and there are as many as limits.
  while (report.succeeded() && ws.finder.find_overrun(model, options, effects, state.q, state.v, w,
                                                      ws.constraints, ws.sleepers.idle_bodies())) {
    if (solved) {
      for_each_touched(model, ws, [&](auto in_tree, auto in_block) {
        w(in_tree) = ws.problem.free_velocity()(in_block);
      });
    }
    solve_found(model, settings, state, ws, w, report);
    solved = true;
  }
}

const VectorX& recover_overlaps(const Model& model, const contact::Settings& settings,
                                const VectorX& w, Workspace::Impl& ws, StepReport& report) {
  const Recovery::Found found = ws.recovery.find(ws.constraints, ws.problem, settings,
                                                 ws.w.head(ws.problem.num_velocities()));
  if (!found.needed) return w;
  report.status = found.status;
  report.newton_iterations += found.iterations;
  report_failure(model, ws.recovery.problem(), ws.recovery.velocity(), ws.recovery.impulse(), ws,
                 report);
  ws.displacement = w;
  for_each_touched(model, ws, [&](auto in_tree, auto in_block) {
    ws.displacement(in_tree) += ws.recovery.velocity()(in_block);
  });
  return ws.displacement;
}

}  // namespace counterpoint
