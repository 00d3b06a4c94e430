#include "counterpoint/engine/constraints/friction_slip.h"

#include <algorithm>
#include <span>

#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

namespace {

/// Slip speed per sliding speed, h / slip_time; 0 for friction models without it.
double slip_share(const SimulationOptions& options) {
  if (options.contact.friction_model != FrictionModel::kCoulomb) return 0.0;
  return options.time_step / options.contact.slip_time;
}

}  // namespace

int& FrictionSlip::fastest_near(const PairConstraint& pair) {
  return fastest_[touching_.root(pair.body_a != 0 ? pair.body_a : pair.body_b)];
}

void FrictionSlip::apply(const SimulationOptions& options, const std::vector<double>& speed,
                         PairConstraint& pair) {
  const double share = slip_share(options);
  if (!(share > 0.0)) return;
  pair.fastest_contact = pair.law.coulomb ? fastest_near(pair) : -1;
  if (pair.fastest_contact >= 0) pair.law.slip_speed = share * speed[pair.fastest_contact];
}

void FrictionSlip::set(const Model& model, const SimulationOptions& options,
                       const std::vector<double>& speed, ConstraintSet& out) {
  if (!(slip_share(options) > 0.0)) return;
  touching_.reset(model.num_bodies());
  const std::span contacts(out.pairs.data(), out.contacts.size());
  for (const PairConstraint& pair : contacts)
    if (pair.body_a != 0 && pair.body_b != 0) touching_.join(pair.body_a, pair.body_b);
  std::fill(fastest_.begin(), fastest_.end(), -1);
  for (size_t i = 0; i < contacts.size(); ++i) {
    int& so_far = fastest_near(contacts[i]);
    if (so_far < 0 || speed[i] > speed[so_far]) so_far = static_cast<int>(i);
  }
  for (PairConstraint& pair : contacts) apply(options, speed, pair);
}

}  // namespace counterpoint
