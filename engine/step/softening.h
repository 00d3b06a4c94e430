// Steps whose contact problem cannot be solved with its own laws, within a bounded effort, are
// solved with softer ones: a physical contact, more compliant for one step.
//
// The solver softens an island (contact/solver.h). A step reports one Softening: that of the
// island, or where several islands needed it, the same factor for all. It is recorded with a
// trajectory, so that the inverse evaluates the laws that were solved.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

contact::Softness softness_of(const Softening& softening);

/// Which trees a Softening is about. Scratch memory inside: one per thread.
class SoftenedTrees {
 public:
  /// Finds the trees that constraints join to softening.tree; all of them if that is -1.
  void find(const Model& model, const ConstraintSet& constraints, const Softening& softening);
  /// Of a constraint between trees, -1 for the world.
  bool holds(int tree_a, int tree_b) const {
    return (tree_a >= 0 && softened_[tree_a]) || (tree_b >= 0 && softened_[tree_b]);
  }

 private:
  contact::DisjointSets islands_;
  std::vector<char> softened_;  ///< by tree
};

/// The softening of a step whose solve reported `softened` (not empty), of which `before` was in
/// force already.
Softening combine(const Softening& before, const std::vector<contact::Report::Softened>& softened,
                  const std::vector<int>& block_of_tree);

}  // namespace counterpoint
