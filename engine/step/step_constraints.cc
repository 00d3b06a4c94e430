#include "counterpoint/engine/step/step_constraints.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/contact_memory.h"
#include "counterpoint/engine/diagnosis/failure_cause.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
namespace {

void grow(VectorX& v, int size) {
  if (v.size() < size) v.resize(size);
}

void grow_keeping(VectorX& v, int size) {
  if (v.size() < size) v.conservativeResize(size);
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

/// Where the rows of the contacts end in a problem, and all rows.
struct RowRange {
  int contacts_end = 0, end = 0;
};

RowRange row_range(const Workspace::Impl& ws) {
  const int contacts = static_cast<int>(ws.posed_contacts), end = ws.problem.num_rows();
  return {contacts < ws.problem.num_constraints() ? ws.problem.first_row(contacts) : end, end};
}

/// Moves the impulses found to the rows of a problem that has more of them: contacts behind the
/// contacts, limits at the end. Nothing is known of those.
void move_impulses(const RowRange& before, const RowRange& now, VectorX& impulse) {
  double* f = impulse.data();
  const int others = before.end - before.contacts_end;
  std::copy_backward(f + before.contacts_end, f + before.end, f + now.contacts_end + others);
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::fill(f + before.contacts_end, f + now.contacts_end, kUnknown);
  std::fill(f + now.contacts_end + others, f + now.end, kUnknown);
}

/// Where no other tolerance is asked for, contacts are solved to this share of their compliance:
/// what is soft shall be cheap, and is no model of anything to twelve digits. 1e-8 of the impulses
/// at eps 0.1, 1e-12 at 1e-5 and below.
constexpr double kToleranceShare = 1e-7;

contact::Settings as_exact_as_hard(const StepArguments& step) {
  contact::Settings settings = step.settings;
  const double usual = contact::Settings().tolerance;
  if (settings.tolerance == usual)
    settings.tolerance = std::max(usual, kToleranceShare * step.options.contact.compliance);
  return settings;
}

/// Poses the problem of the constraints found, of free velocities (nv), and solves it: into ws.w,
/// ws.impulse. The guess is what was found with fewer constraints, velocities `found` (nv) and
/// ws.impulse, or if that is null what the last step knows. as_posed: with these laws, not softer.
const contact::Report& pose_and_solve(const StepArguments& step, const VectorX& free,
                                      const VectorX* found, const Softening& softening,
                                      bool as_posed, Workspace::Impl& ws) {
  const Model& model = step.model;
  const State& state = step.state;
  contact::Settings settings = as_exact_as_hard(step);
  if (as_posed) settings.soften_after = 0;
  const RowRange before = row_range(ws);
  assemble_problem(model, ws.constraints, free, ws.diagonal, ws.data, ws.block_of_tree, ws.problem);
  ws.posed_contacts = ws.constraints.contacts.size();
  soften_problem(model, softening, ws);
  grow(ws.w, ws.problem.num_velocities());
  grow_keeping(ws.impulse, ws.problem.num_rows());
  const VectorX& guess = found != nullptr ? *found : state.v;
  for_each_touched(model, ws,
                   [&](auto in_tree, auto in_block) { ws.w(in_block) = guess(in_tree); });
  Eigen::Ref<VectorX> solution = ws.w.head(ws.problem.num_velocities());
  Eigen::Ref<VectorX> impulse = ws.impulse.head(ws.problem.num_rows());
  if (found != nullptr) {
    move_impulses(before, row_range(ws), ws.impulse);
  } else {
    recall_impulses({ws.constraints, ws.data, ws.problem, step.h()}, state.memory, impulse);
  }
  settings.warm = true;
  return ws.solver.solve(ws.problem, settings, solution, impulse);
}

/// Several islands that need softer laws get them together, and then may need still softer ones.
/// All have the factor that is reported, or the inverse would be wrong: the last solve softens
/// nothing.
constexpr int kMostSoftenings = 4;
/// What that does not solve gets this many times softer laws, as often as this.
constexpr double kSofterAgain = 1024.0;
constexpr int kLastSoftenings = 8;

/// So many times only the contacts run into get rows, then all that are parked.
constexpr int kMostOverruns = 2;

bool is_unsolved(contact::Status status) {
  return status == contact::Status::kMaxIterations || status == contact::Status::kNoProgress;
}

/// Replaces the velocities of the touched trees in w (nv) by the solution of the contact problem of
/// free velocities `free` (nv), which may be w. found: as in pose_and_solve. extended: there are
/// constraints that the inverse, which knows but the last velocity, may not find: they are without
/// force, but join islands, so that softer laws are then those of all trees.
void solve_found(const StepArguments& step, const VectorX& free, const VectorX* found,
                 bool extended, Workspace::Impl& ws, VectorX& w,
                 StepReport& report) {  // Parameters: all it depends on
  const Model& model = step.model;
  for (int i = 0;; ++i) {
    if (extended) report.softening.tree = -1;
    const bool as_posed = i >= kMostSoftenings;
    const contact::Report& solved =
        pose_and_solve(step, free, i == 0 ? found : nullptr, report.softening, as_posed, ws);
    report.status = solved.status;
    report.newton_iterations += solved.iterations;
    report.residual = solved.residual;
    if (as_posed && is_unsolved(solved.status) && i < kMostSoftenings + kLastSoftenings) {
      report.softening.factor *= kSofterAgain;
      continue;
    }
    if (solved.softened.empty()) break;
    const bool first = !report.softening.any();
    report.softening = combine(report.softening, solved.softened, ws.block_of_tree);
    // One island was solved with what the report says; several are solved once more together.
    if (first && !extended && solved.softened.size() == 1) {
      soften_problem(model, report.softening, ws);
      break;
    }
  }
  if (report.softening.any() && contact::succeeded(report.status))
    report.status = contact::Status::kSoftened;
  if (extended) report.softening.tree = -1;
  report_failure(model, ws.problem, ws.w.head(ws.problem.num_velocities()),
                 ws.impulse.head(ws.problem.num_rows()), ws, report);
  for_each_touched(model, ws, [&](auto in_tree, auto in_block) { w(in_tree) = ws.w(in_block); });
}

/// The same once a problem is solved and more constraints were found.
void solve_again(const StepArguments& step, Workspace::Impl& ws, VectorX& w, StepReport& report) {
  ws.displacement = w;
  for_each_touched(step.model, ws, [&](auto in_tree, auto in_block) {
    ws.displacement(in_tree) = ws.problem.free_velocity()(in_block);
  });
  solve_found(step, ws.displacement, &w, true, ws, w, report);
}

/// Velocities that positions change by, into ws.displacement. False if they are w (nv).
bool find_displacement(const StepArguments& step, const VectorX& w, Workspace::Impl& ws,
                       StepReport& report) {
  const OverlapCorrection::Found found = ws.overlap_correction.find(
      ws.constraints, ws.problem, step.h(), as_exact_as_hard(step),
      ws.w.head(ws.problem.num_velocities()), ws.impulse.head(ws.problem.num_rows()));
  if (!found.needed) return false;
  report.newton_iterations += found.iterations;
  // Overlaps that cannot be corrected in this step are left to the next one.
  if (!contact::succeeded(found.status)) return false;
  ws.displacement = w;
  for_each_touched(step.model, ws, [&](auto in_tree, auto in_block) {
    ws.displacement(in_tree) += ws.overlap_correction.velocity()(in_block);
  });
  return true;
}

/// Adds what w runs into, and solves again, until it runs into nothing. solved: w is a solution.
void solve_overruns(const StepArguments& step, bool solved, Workspace::Impl& ws, VectorX& w,
                    StepReport& report) {
  const StepContext at = step.context();
  // Each time a row more, and there are as many as limits and parked contacts. An impact that is
  // passed on from body to body is not followed through their contacts one by one.
  for (int round = 0; report.succeeded() && ws.finder.find_overrun(at, {w}, ws.data, ws.constraints,
                                                                   ws.sleepers.idle_bodies());
       ++round) {
    if (round >= kMostOverruns) ws.finder.unpark_all(at, ws.data, ws.constraints);
    if (solved) {
      solve_again(step, ws, w, report);
    } else {
      solve_found(step, w, nullptr, true, ws, w, report);
    }
    solved = true;
  }
}

}  // namespace

void solve_constraints(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                       StepReport& report) {
  const PhaseTimer timer(ws.times, &PhaseTimes::constraints);
  const bool any = !ws.constraints.empty();
  if (any) solve_found(step, w, nullptr, false, ws, w, report);
  solve_overruns(step, any, ws, w, report);
}

const VectorX& correct_overlaps(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                                StepReport& report) {
  const PhaseTimer timer(ws.times, &PhaseTimes::overlaps);
  while (find_displacement(step, w, ws, report)) {
    // What the displacement runs into gets rows as well. The velocity does not lead there, so that
    // they are without force: w stays as it is but for that (parked_contacts.h), and the inverse
    // need not know. Not so with softer laws, which act at a distance: then it gets none.
    if (report.softening.any() || !ws.finder.find_reached_contacts(
                                      step.context(), {ws.displacement}, ws.data, ws.constraints))
      return ws.displacement;
    solve_again(step, ws, w, report);
    solve_overruns(step, true, ws, w, report);
    if (!report.succeeded()) break;
  }
  return w;
}

}  // namespace counterpoint
