// Slip that exact Coulomb friction allows while bodies that touch one another move.
//
//   v_slip = (h / slip_time) max |V_T|,   V_T the sliding velocity at (q, w) of a contact of the
//   two bodies, or of bodies that touch them, and so on
//
// Joints, closures and the world pass nothing on: a grip does not slip because a wheel of the same
// robot skids.
//
// Friction reaches its bound at a slip of v_slip more (contact/laws/coulomb.h), whatever the load.
// How many sticking contacts share loads changes with every micrometre that they move; a slip
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
  explicit FrictionSlip(const Model& model) : fastest_(model.num_bodies(), -1) {}

  /// Sets law.slip_speed and `fastest` of all contacts with rows. speed: how fast each
  /// of out.contacts slides [m/s].
  void set(const Model& model, const SimulationOptions& options, const std::vector<double>& speed,
           ConstraintSet& out);
  /// The same of one that gets rows later, with the arguments of the last set().
  void apply(const SimulationOptions& options, const std::vector<double>& speed,
             PairConstraint& pair);

 private:
  int& fastest_near(const PairConstraint& pair);

  contact::DisjointSets touching_;  ///< bodies
  std::vector<int> fastest_;        ///< by root of a set: its fastest contact, or -1
};

}  // namespace counterpoint
