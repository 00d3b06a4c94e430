// The solve and the overlap-correction stages of a step: the velocities that its constraints lead
// to, and the velocities that displace the bodies.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/step/overlap_correction.h"
#include "counterpoint/engine/step/softening.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {

/// The contact problem of a step and its solution. The vectors only grow, since Eigen allocates
/// whenever a size changes: the first problem.num_velocities() and num_rows() entries are in use.
struct ContactSolution {
  contact::Problem problem;
  std::vector<int> block_of_tree;  ///< per tree: its block of the problem, or -1
  size_t num_contacts = 0;         ///< the first constraints of the problem are contacts
  VectorX velocity;                ///< velocities of the touched trees, in the problem's order
  VectorX impulse;                 ///< impulses of all rows [N s, N m s]
  VectorX free_velocity;           ///< nv: scratch of a second solve
  contact::Solver solver;
  SoftenedTrees softened_trees;

  Eigen::Ref<VectorX> velocities() { return velocity.head(problem.num_velocities()); }
  Eigen::Ref<VectorX> impulses() { return impulse.head(problem.num_rows()); }
  VectorRef impulses() const { return impulse.head(problem.num_rows()); }
  /// Makes room for the problem; impulses keep their values.
  void grow();
};

/// Calls visit(of_tree, of_block) for every tree that constraints touch: the places of its
/// velocities among the model's, and among the problem's.
template <class Visit>
void for_each_touched(const Model& model, const ContactSolution& solution, Visit visit) {
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = solution.block_of_tree[static_cast<size_t>(t)];
    if (block < 0) continue;
    const Tree& tree = model.trees()[static_cast<size_t>(t)];
    const int size = tree.v_end - tree.v_begin;
    visit(Eigen::seqN(tree.v_begin, size), Eigen::seqN(solution.problem.block_start(block), size));
  }
}

/// Solves the constraints of a step. It writes the constraints (adding those that a solution shows
/// to be missing: joint_limits.h, parked_contacts.h), the solution and the report.
class ConstraintStage {
 public:
  /// motion: forces and scratch memory with which the free velocity was found. All must outlive
  /// this object.
  ConstraintStage(const StageInput& in, FreeMotion& motion, ConstraintFinder& finder,
                  ConstraintSet& constraints, ContactSolution& solution, StepReport& report);

  /// Replaces the free velocities of the touched trees in w (nv) by the solution of the contact
  /// problem, and adds the limits and parked contacts that it reaches, also where there were no
  /// constraints. Needs inertias in in.start.
  void solve(VectorX& w);

  /// Returns the velocity that displaces the bodies: w, or `displacement` filled with w + p where
  /// bodies overlap too far or bounce late (overlap_correction.h). Call after solve(). Contacts
  /// that w + p reaches are added, and w is found again with them.
  const VectorX& correct_overlaps(OverlapCorrection& correction, VectorX& displacement, VectorX& w);

 private:
  enum class Guess { kLastStep, kLastSolution };
  const contact::Report& pose_and_solve(const VectorX& free, const VectorX& guess, Guess from,
                                        bool as_posed);
  void soften_problem();
  void solve_problem(const VectorX& free, Guess from, bool extended, VectorX& w);
  bool is_spent() const;
  void restore_free_velocity(const VectorX& w);
  void solve_again(VectorX& w);
  void solve_overruns(bool solved, VectorX& w);
  bool find_displacement(OverlapCorrection& correction, const VectorX& w, VectorX& displacement);
  void report_failure();

  const StageInput& in_;
  FreeMotion& motion_;
  ConstraintFinder& finder_;
  ConstraintSet& constraints_;
  ContactSolution& solution_;
  StepReport& report_;
};

}  // namespace counterpoint
