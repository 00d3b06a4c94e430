#include "counterpoint/engine/step/softening.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint {

namespace {

/// A regularizer [1/kg] at which no law gives an impulse, far from overflow.
constexpr double kNoLaw = 1e150;

/// The lowest tree of a block.
int tree_of(int block, const std::vector<int>& block_of_tree) {
  const auto tree = std::find(block_of_tree.begin(), block_of_tree.end(), block);
  return static_cast<int>(tree - block_of_tree.begin());
}

}  // namespace

contact::Law soften(const contact::Law& law, const Softening& softening) {
  if (!softening.unfinished())
    return contact::soften(law, {std::abs(softening.factor), softening.factor < 0.0});
  contact::Law none = law;
  none.regularizer = kNoLaw;
  none.smoothing = 0.0;
  if (none.normal > 0.0) none.normal = kNoLaw;
  return none;
}

void SoftenedTrees::find(const Model& model, const ConstraintSet& constraints,
                         const Softening& softening) {
  softened_.resize(model.num_trees());
  join_constrained_trees(model, constraints, islands_);
  const bool known = softening.tree >= 0 && softening.tree < model.num_trees();
  const int island = known ? islands_.root(softening.tree) : -1;
  for (int t = 0; t < model.num_trees(); ++t)
    softened_[t] = softening.any() && (!known || islands_.root(t) == island);
}

Softening combine(const Softening& before, const std::vector<contact::Report::Softened>& softened,
                  const std::vector<int>& block_of_tree) {
  Softening out;
  double largest = 1.0;
  bool convex = before.factor < 0.0;
  for (const auto& [block, softness] : softened) {
    largest = std::max(largest, softness.factor);
    convex = convex || softness.convex;
  }
  largest *= std::abs(before.factor);
  out.factor = convex ? -largest : largest;
  out.tree = tree_of(softened.front().block, block_of_tree);
  if (softened.size() > 1 || (before.any() && before.tree != out.tree)) out.tree = -1;
  return out;
}

Softening mark_unfinished(const std::vector<int>& blocks, const std::vector<int>& block_of_tree) {
  return {std::numeric_limits<double>::infinity(),
          blocks.size() == 1 ? tree_of(blocks[0], block_of_tree) : -1};
}

}  // namespace counterpoint
