// Slip that exact Coulomb friction allows while its island moves.
//
//   v_slip = (h / slip_time) max |V_T|,   V_T the sliding velocity of a contact of the island at
//   (q, w)
//
// Friction reaches its bound at a slip of v_slip more (contact/laws/coulomb.h), whatever the load.
// How many sticking contacts share loads changes with every micrometre that an island moves; a slip
// of a thousandth of that motion prevents this. It vanishes with the motion, and with h as the
// error of the integrator does, and it does not depend on the load, unlike creep by compliance.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

struct ConstraintSet;
struct PairConstraint;

/// Scratch memory inside: one per thread.
class FrictionSlip {
 public:
  explicit FrictionSlip(const Model& model) : fastest_(model.num_trees(), -1) {}

  /// Sets law.slip_speed and `fastest` of all contacts with rows. speed: how fast each
  /// of out.contacts slides [m/s].
  void set(const Model& model, const SimulationOptions& options, const std::vector<double>& speed,
           ConstraintSet& out);
  /// The same of one that gets rows later, with the arguments of the last set().
  void apply(const Model& model, const SimulationOptions& options, const std::vector<double>& speed,
             PairConstraint& pair);

 private:
  int& fastest_in_island(const Model& model, const PairConstraint& pair);

  contact::DisjointSets islands_;
  std::vector<int> fastest_;  ///< by root of an island: its fastest contact, or -1
};

}  // namespace counterpoint
