#include "counterpoint/engine/step/step_constraints.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/contact_memory.h"
#include "counterpoint/engine/diagnosis/failure_cause.h"

namespace counterpoint {
namespace {

/// Rows of the contacts in a problem end at the first, all rows at the second.
struct RowRange {
  int contacts_end = 0, end = 0;
};

RowRange row_range(const ContactSolution& solution) {
  const contact::Problem& problem = solution.problem;
  const int contacts = static_cast<int>(solution.num_contacts), end = problem.num_rows();
  return {contacts < problem.num_constraints() ? problem.first_row(contacts) : end, end};
}

/// Moves impulses to the rows of a problem with more of them: new contacts stand behind the
/// contacts, new limits at the end. Their impulses become NaN, which means unknown.
void move_impulses(const RowRange& before, const RowRange& now, VectorX& impulse) {
  double* f = impulse.data();
  const int others = before.end - before.contacts_end;
  std::copy_backward(f + before.contacts_end, f + before.end, f + now.contacts_end + others);
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::fill(f + before.contacts_end, f + now.contacts_end, kUnknown);
  std::fill(f + now.contacts_end + others, f + now.end, kUnknown);
}

/// The default tolerance of the contact solve is at least this share of the compliance eps: soft
/// contacts model nothing to twelve digits, and a looser tolerance saves Newton steps. It is 1e-8
/// of the impulses at eps = 0.1, and 1e-12 at eps <= 1e-5.
constexpr double kToleranceShare = 1e-7;

/// Newton steps of a solve whose step has spent its budget: a solve after the first starts from the
/// solution before it, and usually needs no more.
constexpr int kStepsBeyondBudget = 4;

contact::Settings solver_settings(const StepArguments& step, const StepReport& report) {
  contact::Settings settings = step.settings;
  const int budget = step.options.step_budget;
  if (budget > 0 && !report.softening.softens())
    settings.stop_after = std::max(budget - report.newton_iterations, kStepsBeyondBudget);
  const double usual = contact::Settings().tolerance;
  if (settings.tolerance == usual)
    settings.tolerance = std::max(usual, kToleranceShare * step.options.contact.compliance);
  return settings;
}

/// Islands that need softer laws are softened together, up to this number of times, each time by
/// the largest factor among them: the inverse knows a single factor. In later solves the solver may
/// not soften; the stage does (kSofterAgain).
constexpr int kMostSoftenings = 4;
/// Problems that remain unsolved get laws softer by this factor, up to this number of times.
constexpr double kSofterAgain = 1024.0;
constexpr int kLastSoftenings = 8;

/// In the first rounds only contacts that w+ reaches get rows. In each later one, those that it
/// would reach in kAhead times as many steps as in the round before get them, too: an impact that
/// travels from body to body is not followed contact by contact.
constexpr int kFirstOverruns = 2;
constexpr double kAhead = 4.0;

bool is_unsolved(contact::Status status) {
  return status == contact::Status::kMaxIterations || status == contact::Status::kNoProgress;
}

}  // namespace

void ContactSolution::grow() {
  if (velocity.size() < problem.num_velocities()) velocity.resize(problem.num_velocities());
  if (impulse.size() < problem.num_rows()) impulse.conservativeResize(problem.num_rows());
}

ConstraintStage::ConstraintStage(const StageInput& in, FreeMotion& motion, ConstraintFinder& finder,
                                 ConstraintSet& constraints, ContactSolution& solution,
                                 StepReport& report)
    : in_(in),
      motion_(motion),
      finder_(finder),
      constraints_(constraints),
      solution_(solution),
      report_(report) {}

void ConstraintStage::report_failure() {
  if (report_.succeeded()) return;
  report_.fault =
      solver_fault(in_.step.model, report_.status, constraints_, solution_.problem,
                   solution_.block_of_tree, solution_.velocities(), solution_.impulses());
}

/// Softens the laws of the problem that the softening in the report covers.
void ConstraintStage::soften_problem() {
  const Softening& softening = report_.softening;
  if (!softening.softens()) return;
  const Model& model = in_.step.model;
  solution_.softened_trees.find(model, constraints_, softening);
  int c = 0;
  for_each_constraint(model, constraints_, [&](int tree_a, int tree_b) {
    contact::Law& law = solution_.problem.law(c++);
    if (solution_.softened_trees.holds(tree_a, tree_b)) law = soften(law, softening);
  });
}

/// Poses the problem of the constraints with free velocities `free` (nv), and solves it from the
/// velocities `guess` (nv) and either the impulses of the last solution, which had fewer
/// constraints, or those that the state remembers. as_posed: the solver may not soften laws.
const contact::Report& ConstraintStage::pose_and_solve(const VectorX& free, const VectorX& guess,
                                                       Guess from, bool as_posed) {
  const Model& model = in_.step.model;
  const Kinematics& at = in_.start.kinematics();
  contact::Problem& problem = solution_.problem;
  contact::Settings settings = solver_settings(in_.step, report_);
  if (as_posed) settings.soften_after = 0;
  const RowRange before = row_range(solution_);
  assemble_problem(model, constraints_, free, motion_.forces.diagonal,
                   BodyState(at, in_.start.velocity_forces(), motion_.external, motion_.scratch),
                   solution_.block_of_tree, problem, in_.pool);
  solution_.num_contacts = constraints_.contacts.size();
  soften_problem();
  if (in_.prescribed != nullptr) in_.prescribed->eliminate(model, solution_.block_of_tree, problem);
  solution_.grow();
  for_each_touched(model, solution_, [&](auto in_tree, auto in_block) {
    solution_.velocity(in_block) = guess(in_tree);
  });
  Eigen::Ref<VectorX> velocities = solution_.velocities(), impulses = solution_.impulses();
  if (from == Guess::kLastSolution) {
    move_impulses(before, row_range(solution_), solution_.impulse);
  } else {
    recall_impulses({constraints_, at, problem, in_.step.h()}, in_.step.state.memory, impulses);
  }
  settings.warm = true;
  return solution_.solver.solve(problem, settings, velocities, impulses);
}

/// Replaces the velocities of the touched trees in w (nv) by the solution of the contact problem
/// with free velocities `free` (nv), which may be w. Starts from w if `from` is the last solution.
/// extended: rows were added after the first solve. The inverse may miss those that the final w
/// does not reach; they carry no force but join islands, so a softening must cover all trees.
void ConstraintStage::solve_problem(const VectorX& free, Guess from, bool extended, VectorX& w) {
  if (report_.softening.unfinished()) report_.softening = {};  // this solve may finish
  for (int i = 0;; ++i) {
    if (extended) report_.softening.tree = -1;
    const bool as_posed = i >= kMostSoftenings;
    const Guess guess = i == 0 ? from : Guess::kLastStep;
    const contact::Report& solved =
        pose_and_solve(free, guess == Guess::kLastSolution ? w : in_.step.state.v, guess, as_posed);
    report_.status = solved.status;
    report_.newton_iterations += solved.iterations;
    report_.residual = solved.residual;
    if (as_posed && is_unsolved(solved.status) && i < kMostSoftenings + kLastSoftenings) {
      report_.softening.factor *= kSofterAgain;
      continue;
    }
    if (!solved.unfinished.empty()) {
      report_.softening = mark_unfinished(solved.unfinished, solution_.block_of_tree);
      break;
    }
    if (solved.softened.empty()) break;
    const bool first = !report_.softening.any();
    report_.softening = combine(report_.softening, solved.softened, solution_.block_of_tree);
    // A single island was solved with the laws that the report tells. Several have different
    // factors, and are solved once more with the largest.
    if (first && !extended && solved.softened.size() == 1) {
      soften_problem();
      break;
    }
  }
  if (report_.softening.softens() && contact::succeeded(report_.status))
    report_.status = contact::Status::kSoftened;
  if (extended) report_.softening.tree = -1;
  report_failure();
  for_each_touched(in_.step.model, solution_,
                   [&](auto in_tree, auto in_block) { w(in_tree) = solution_.velocity(in_block); });
}

/// Whether the step has a budget of Newton steps and has taken them.
bool ConstraintStage::is_spent() const {
  const int budget = in_.step.options.step_budget;
  return budget > 0 && report_.newton_iterations >= budget;
}

/// Sets solution_.free_velocity to the free velocity of the solution w (nv).
void ConstraintStage::restore_free_velocity(const VectorX& w) {
  solution_.free_velocity = w;
  for_each_touched(in_.step.model, solution_, [&](auto in_tree, auto in_block) {
    solution_.free_velocity(in_tree) = solution_.problem.free_velocity()(in_block);
  });
}

/// Solves again after constraints were added, starting from the last solution w.
void ConstraintStage::solve_again(VectorX& w) {
  restore_free_velocity(w);
  solve_problem(solution_.free_velocity, Guess::kLastSolution, true, w);
}

/// Adds rows for the limits and contacts that w reaches and solves again, until it reaches
/// none. This ends, since each round adds a row and their number is limited. solved: w is a
/// solution of a contact problem.
void ConstraintStage::solve_overruns(bool solved, VectorX& w) {
  const StepContext context = in_.step.context();
  const Kinematics& at = in_.start.kinematics();
  double ahead = 1.0;
  const auto add_rows = [&](int round) {
    const bool reached =
        finder_.find_overrun(context, {w}, at, constraints_, in_.sleepers.sleep_mask());
    if (reached && round >= kFirstOverruns)
      finder_.contacts().find_reached(context, {w}, at, constraints_, ahead *= kAhead);
    return (report_.softening.softens() && ContactFinder::activate_all(constraints_)) || reached;
  };
  for (int round = 0; report_.succeeded() && add_rows(round); ++round) {
    if (solved) {
      solve_again(w);
    } else {
      solve_problem(w, Guess::kLastStep, true, w);
    }
    solved = true;
  }
}

void ConstraintStage::solve(VectorX& w) {
  const StepArguments& step = in_.step;
  const Softening given = report_.softening;
  if (!given.softens())
    finder_.contacts().set_inactive(step.context(), in_.start.kinematics(), step.state.memory,
                                    constraints_);
  const bool any = !constraints_.empty();
  if (any) solve_problem(w, Guess::kLastStep, false, w);
  if (report_.softening.softens() && ContactFinder::activate_all(constraints_)) {
    // The inverse softens the trees that all contacts join.
    report_.softening = given;
    restore_free_velocity(w);
    solve_problem(solution_.free_velocity, Guess::kLastStep, false, w);
  }
  solve_overruns(any, w);
}

/// Finds the velocity that displaces the bodies. False if it is w (nv).
bool ConstraintStage::find_displacement(OverlapCorrection& correction, const VectorX& w,
                                        VectorX& displacement) {
  const OverlapCorrection::Found found = correction.find(
      constraints_, solution_.problem, in_.step.h(), solver_settings(in_.step, report_),
      solution_.velocities(), solution_.impulses(),
      in_.prescribed != nullptr ? in_.prescribed->shifts() : std::span<const double>());
  if (!found.needed) return false;
  report_.newton_iterations += found.iterations;
  // Overlaps that cannot be corrected in this step are left to the next one.
  if (!contact::succeeded(found.status)) return false;
  displacement = w;
  for_each_touched(in_.step.model, solution_, [&](auto in_tree, auto in_block) {
    displacement(in_tree) += correction.velocity()(in_block);
  });
  return true;
}

const VectorX& ConstraintStage::correct_overlaps(OverlapCorrection& correction,
                                                 VectorX& displacement, VectorX& w) {
  while (find_displacement(correction, w, displacement)) {
    // Contacts that the displacement reaches get rows as well. The velocity w does not reach them,
    // so they carry no force, w changes by the solver's tolerance only (parked_contacts.h), and the
    // inverse need not know of them. Softer laws act at a distance: with them no rows are added.
    // Where the budget is spent, such contacts overlap until the next step.
    if (report_.softening.softens() || is_spent() ||
        !finder_.contacts().find_reached(in_.step.context(), {displacement}, in_.start.kinematics(),
                                         constraints_))
      return displacement;
    solve_again(w);
    solve_overruns(true, w);
    if (!report_.succeeded()) break;
  }
  return w;
}

}  // namespace counterpoint
