#include "counterpoint/engine/step/softening.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {

contact::Softness softness_of(const Softening& softening) {
  return {std::abs(softening.factor), softening.factor < 0.0};
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
  const auto tree = std::find(block_of_tree.begin(), block_of_tree.end(), softened.front().block);
  out.tree = static_cast<int>(tree - block_of_tree.begin());
  if (softened.size() > 1 || (before.any() && before.tree != out.tree)) out.tree = -1;
  return out;
}

}  // namespace counterpoint
