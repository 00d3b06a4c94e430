// Softer contact laws for steps whose contact problem cannot be solved with its own laws within a
// bounded effort: a physical contact that is more compliant for one step.
//
// The solver softens single islands (contact/solver.h). A step reports one Softening: that of the
// island or, where several islands were softened, one factor for all trees. Trajectories record it,
// so that the inverse evaluates the laws that were solved.
//
// A step with a budget (SimulationOptions::step_budget) does not soften laws. It ends with impulses
// that obey them roughly, and a Softening with an infinite factor marks its islands. The inverse
// does not know these impulses: it counts them as applied.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Returns the law of a constraint under a softening that covers it. That of an unfinished step
/// gives no impulse worth counting.
contact::Law soften(const contact::Law& law, const Softening& softening);

/// The trees that a Softening covers. Scratch memory: one per thread.
class SoftenedTrees {
 public:
  /// Finds the trees that constraints join to softening.tree; all trees if that is -1.
  void find(const Model& model, const ConstraintSet& constraints, const Softening& softening);
  /// Whether the softening covers a constraint between two trees; -1 is the world.
  bool holds(int tree_a, int tree_b) const {
    return (tree_a >= 0 && softened_[tree_a]) || (tree_b >= 0 && softened_[tree_b]);
  }

 private:
  contact::DisjointSets islands_;
  std::vector<char> softened_;  ///< per tree
};

/// Returns the softening of a step whose solve, with `before` in force, reported `softened` (not
/// empty).
Softening combine(const Softening& before, const std::vector<contact::Report::Softened>& softened,
                  const std::vector<int>& block_of_tree);

/// Returns the mark of a step that left these blocks (not empty) unfinished.
Softening mark_unfinished(const std::vector<int>& blocks, const std::vector<int>& block_of_tree);

}  // namespace counterpoint
