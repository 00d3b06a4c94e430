#include "counterpoint/engine/constraints/friction_slip.h"

#include <algorithm>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

namespace {

/// Of what moves, the speed that friction slips at; 0 where it does not go by that.
double slip_share(const SimulationOptions& options) {
  if (options.contact.friction_model != FrictionModel::kCoulomb) return 0.0;
  return options.time_step / options.contact.slip_time;
}

}  // namespace

int& FrictionSlip::fastest_in_island(const Model& model, const PairConstraint& pair) {
  const int tree = model.body(pair.body_a).tree;
  return fastest_[islands_.root(tree >= 0 ? tree : model.body(pair.body_b).tree)];
}

void FrictionSlip::apply(const Model& model, const SimulationOptions& options,
                         const std::vector<double>& speed, PairConstraint& pair) {
  const double share = slip_share(options);
  if (!(share > 0.0)) return;
  pair.fastest = pair.law.coulomb ? fastest_in_island(model, pair) : -1;
  if (pair.fastest >= 0) pair.law.slip_speed = share * speed[pair.fastest];
}

void FrictionSlip::set(const Model& model, const SimulationOptions& options,
                       const std::vector<double>& speed, ConstraintSet& out) {
  if (!(slip_share(options) > 0.0)) return;
  join_constrained_trees(model, out, islands_);
  std::fill(fastest_.begin(), fastest_.end(), -1);
  for (size_t i = 0; i < out.contacts.size(); ++i) {
    int& so_far = fastest_in_island(model, out.pairs[i]);
    if (so_far < 0 || speed[i] > speed[so_far]) so_far = static_cast<int>(i);
  }
  for (size_t i = 0; i < out.contacts.size(); ++i) apply(model, options, speed, out.pairs[i]);
}

}  // namespace counterpoint
