#include "counterpoint/engine/constraints/friction_slip.h"

#include <algorithm>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

void FrictionSlip::set(const Model& model, const SimulationOptions& options,
                       const std::vector<double>& speed, ConstraintSet& out) {
  const double share = options.time_step / options.contact.slip_time;
  if (options.contact.friction_model != FrictionModel::kCoulomb || !(share > 0.0)) return;
  join_constrained_trees(model, out, islands_);
  std::fill(fastest_.begin(), fastest_.end(), -1);
  const auto fastest = [&](const PairConstraint& pair) -> int& {
    const int tree = model.body(pair.body_a).tree;
    return fastest_[islands_.root(tree >= 0 ? tree : model.body(pair.body_b).tree)];
  };
  for (size_t i = 0; i < out.contacts.size(); ++i) {
    int& so_far = fastest(out.pairs[i]);
    if (so_far < 0 || speed[i] > speed[so_far]) so_far = static_cast<int>(i);
  }
  const auto apply = [&](PairConstraint& pair) {
    pair.fastest = pair.law.coulomb ? fastest(pair) : -1;
    if (pair.fastest >= 0) pair.law.slip_speed = share * speed[pair.fastest];
  };
  for (size_t i = 0; i < out.contacts.size(); ++i) apply(out.pairs[i]);
  for (ParkedContact& parked : out.parked) apply(parked.pair);
}

}  // namespace counterpoint
