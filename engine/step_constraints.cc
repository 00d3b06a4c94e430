#include "counterpoint/engine/step_constraints.h"

#include <cmath>

#include "counterpoint/engine/contact_memory.h"
#include "counterpoint/engine/culprit.h"
#include "counterpoint/engine/parked_contacts.h"
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

/// The laws of the problem that a softening is about become softer.
void soften_problem(const Model& model, const Softening& softening, Workspace::Impl& ws) {
  if (!softening.any()) return;
  ws.softened_trees.find(model, ws.constraints, softening);
  const contact::Softness softness = softness_of(softening);
  int c = 0;
  for_each_constraint(model, ws.constraints, [&](int tree_a, int tree_b) {
    contact::Law& law = ws.problem.law(c++);
    if (ws.softened_trees.holds(tree_a, tree_b)) law = contact::soften(law, softness);
  });
}

/// Poses the problem of the constraints found, of free velocities w (nv), and solves it: into ws.w,
/// ws.impulse.
const contact::Report& pose_and_solve(const Model& model, contact::Settings settings, double h,
                                      const State& state, const VectorX& w,
                                      const Softening& softening, Workspace::Impl& ws) {
  assemble_problem(model, ws.constraints, w, ws.diagonal, ws.data, ws.block_of_tree, ws.problem);
  soften_problem(model, softening, ws);
  grow(ws.w, ws.problem.num_velocities());
  grow(ws.impulse, ws.problem.num_rows());
  for_each_touched(model, ws,
                   [&](auto in_tree, auto in_block) { ws.w(in_block) = state.v(in_tree); });
  Eigen::Ref<VectorX> solution = ws.w.head(ws.problem.num_velocities());
  Eigen::Ref<VectorX> impulse = ws.impulse.head(ws.problem.num_rows());
  recall_impulses(ws.constraints, ws.data, h, state.memory, ws.problem, impulse);
  settings.warm = true;
  return ws.solver.solve(ws.problem, settings, solution, impulse);
}

/// Several islands that need softer laws get them together, and then may need still softer ones.
constexpr int kMostSoftenings = 4;

/// So many times only the contacts run into get rows, then all that are parked.
constexpr int kMostOverruns = 2;

/// Replaces the velocities of the touched trees in w (nv), those without constraints, by the
/// solution of the contact problem.
void solve_found(const Model& model, const contact::Settings& settings, double h,
                 const State& state, Workspace::Impl& ws, VectorX& w, StepReport& report) {
  for (int i = 0;; ++i) {
    const contact::Report& solved =
        pose_and_solve(model, settings, h, state, w, report.softening, ws);
    report.status = solved.status;
    report.newton_iterations += solved.iterations;
    report.residual = solved.residual;
    if (solved.softened.empty()) break;
    const bool first = !report.softening.any();
    report.softening = combine(report.softening, solved.softened, ws.block_of_tree);
    if (i + 1 == kMostSoftenings) report.softening.factor = -std::abs(report.softening.factor);
    // One island was solved with what the report says; several are solved once more together.
    if (i == kMostSoftenings) break;
    if (first && solved.softened.size() == 1) {
      soften_problem(model, report.softening, ws);
      break;
    }
  }
  if (report.softening.any() && report.status == contact::Status::kConverged)
    report.status = contact::Status::kSoftened;
  report_failure(model, ws.problem, ws.w.head(ws.problem.num_velocities()),
                 ws.impulse.head(ws.problem.num_rows()), ws, report);
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
  if (solved) solve_found(model, settings, options.time_step, state, ws, w, report);
  // Each time a row more, and there are as many as limits. An impact that is passed on from body to
  // body is not followed through their contacts one by one.
  for (int round = 0;
       report.succeeded() && ws.finder.find_overrun(model, options, effects, state.q, state.v, w,
                                                      ws.data, ws.constraints, ws.sleepers.idle_bodies());
       ++round) {
    if (round >= kMostOverruns) unpark_all(ws.constraints);
    if (solved) {
      for_each_touched(model, ws, [&](auto in_tree, auto in_block) {
        w(in_tree) = ws.problem.free_velocity()(in_block);
      });
    }
    solve_found(model, settings, options.time_step, state, ws, w, report);
    solved = true;
  }
}

const VectorX& recover_overlaps(const Model& model, const contact::Settings& settings,
                                const VectorX& w, Workspace::Impl& ws, StepReport& report) {
  const Recovery::Found found = ws.recovery.find(ws.constraints, ws.problem, settings,
                                                 ws.w.head(ws.problem.num_velocities()));
  if (!found.needed) return w;
  report.newton_iterations += found.iterations;
  // Overlaps that cannot be corrected in this step are left to the next one.
  if (!contact::succeeded(found.status)) return w;
  ws.displacement = w;
  for_each_touched(model, ws, [&](auto in_tree, auto in_block) {
    ws.displacement(in_tree) += ws.recovery.velocity()(in_block);
  });
  return ws.displacement;
}

}  // namespace counterpoint
