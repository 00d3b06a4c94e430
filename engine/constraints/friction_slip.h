// Slip at which regularized Coulomb friction reaches its bound while bodies in contact move.
//
//   v_slip = (h / slip_time) max |V_T|,   V_T the sliding velocity at (q, w) of a contact of the
//   two bodies, or of bodies connected to them by contacts
//
// Joints, closures and the world do not connect: a grip does not slip because a wheel of the same
// robot skids.
//
// The slip at which friction reaches its bound grows by v_slip (contact/laws/cones.h), whatever
// the load. The distribution of loads over sticking contacts changes with every micrometre of
// motion; a slip of a thousandth of that motion prevents this. The slip vanishes with the motion,
// and with h like the error of the integrator; unlike creep by compliance it does not depend on the
// load.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

struct ConstraintSet;
struct PairConstraint;

/// Sets the slip speed of contacts. Holds scratch memory: use one per thread.
class FrictionSlip {
 public:
  explicit FrictionSlip(const Model& model) : fastest_(model.num_bodies(), -1) {}

  /// Sets law.slip_speed and fastest_contact of all contacts with rows. speed: sliding speed of
  /// each of out.contacts [m/s].
  void set(const Model& model, const SimulationOptions& options, const std::vector<double>& speed,
           ConstraintSet& out);
  /// Does the same for one contact that gets rows later, with the arguments of the last set().
  void apply(const SimulationOptions& options, const std::vector<double>& speed,
             PairConstraint& pair);

 private:
  int& fastest_near(const PairConstraint& pair);

  contact::DisjointSets touching_;  ///< sets of bodies connected by contacts
  std::vector<int> fastest_;        ///< per set, at its root: its fastest contact, or -1
};

}  // namespace counterpoint
