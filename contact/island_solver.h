// Solves one island: straight by Newton where that works, else by the primal-dual interior point
// with Newton to finish, else along the path of falling smoothing, else, with Coulomb laws, by the
// fixed point on De Saxce's shift.
#pragma once

#include <vector>

#include "counterpoint/contact/interior_point.h"
#include "counterpoint/contact/island_system.h"
#include "counterpoint/contact/newton.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

class IslandSolver {
 public:
  /// w: start on entry, answer on return; f: impulses at w. Both in the island's numbering.
  Newton::Result solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
                       std::vector<double>& f);
  const Newton::Totals& totals() const { return newton_.totals(); }
  /// The last island was not solved by Newton alone.
  bool continued() const { return continued_; }

 private:
  struct Target {
    double smoothing, regularizer;            ///< k, r of the law
    double unit_smoothing, unit_regularizer;  ///< their values at kappa = 1
    double bias;                              ///< b_N of the law
    bool coulomb;
  };
  int steps_left(const Settings& settings) const;
  void remember_targets(IslandSystem& system);
  bool set_kappa(IslandSystem& system, double kappa) const;
  Newton::Result follow_path(IslandSystem& system, const Settings& settings, std::vector<double>& w,
                             std::vector<double>& f);
  Newton::Result iterate_shift(IslandSystem& system, const Settings& settings,
                               std::vector<double>& w, std::vector<double>& f);

  Newton newton_;
  InteriorPoint interior_point_;
  bool continued_ = false;
  std::vector<Target> targets_;
  std::vector<double> start_, last_good_, before_good_, y_, shift_;
};

}  // namespace counterpoint::contact
