#include "counterpoint/engine/step_constraints.h"

#include "counterpoint/engine/culprit.h"
#include "counterpoint/engine/step_forces.h"

namespace counterpoint {
namespace {

void grow(VectorX& v, int size) {
  if (v.size() < size) v.resize(size);
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

}  // namespace counterpoint
