// Newton's method on the next velocity of one island, at the present smoothing of its laws.
//
// Without Coulomb laws the residual M(w - w*) - J'f(Jw + b) is the gradient of a convex cost:
// Cholesky, and a line search for its zero along the direction, which cannot fail but to round-off.
// With Coulomb laws it is no gradient: LU, and steps halved until the norm of the residual falls.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/line_search.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

/// Room for the steps of a solve: histories do not allocate in the middle of a run.
inline constexpr std::size_t kUsualHistory = 256;

class Newton {
 public:
  struct Result {
    Status status = Status::kConverged;
    int iterations = 0;
    double residual = 0.0;  ///< relative, as Report says
  };
  struct Totals {
    int iterations = 0;
    int line_search_evaluations = 0;
    std::vector<double> residual_history;
  };

  /// Begins with an island: sizes memory, forgets the totals.
  void begin(IslandSystem& system);
  /// Replaces w by the free velocity if that has the smaller residual: a contact at rest starts
  /// well from the last velocity, a flight from the free one.
  /// f: room for impulses. resume() then starts there.
  void choose_start(std::vector<double>& w, std::vector<double>& f);
  /// At most `max_iterations` factorizations towards a relative residual of `tolerance`. w: start
  /// on entry, answer on return; f: impulses at w. contraction: share of the residual that a step
  /// with the system's present factors is expected to leave; 1 where they are of no use.
  Result run(double tolerance, int max_iterations, std::vector<double>& w, std::vector<double>& f,
             double contraction = 1.0);
  /// Goes on where the last run or choose_start() ended, with its w, f and laws: nothing is
  /// computed anew.
  Result resume(double tolerance, int max_iterations, std::vector<double>& w,
                std::vector<double>& f);

  /// Adds steps taken elsewhere to the totals.
  void count(int iterations) { totals_.iterations += iterations; }
  const Totals& totals() const { return totals_; }

 private:
  void evaluate_residual(const std::vector<double>& w, std::vector<double>& f);
  double roundoff_floor(const std::vector<double>& w);
  bool factors_suffice(double tolerance) const;
  bool factor();
  void solve_direction();
  void record();
  void linearize();
  bool at_floor(bool moved, bool reused, double best, const std::vector<double>& w);
  bool advance(std::vector<double>& w, std::vector<double>& f, bool reused);
  bool take_step(double alpha, double before, std::vector<double>& w, std::vector<double>& f);
  LineSearchResult search_step();
  bool advance_cost(std::vector<double>& w);
  bool advance_residual(std::vector<double>& w, std::vector<double>& f);

  IslandSystem* system_ = nullptr;
  bool unsymmetric_ = false;
  bool evaluated_ = false;   ///< the residual kept inside is that of the point at hand
  bool linearized_ = false;  ///< and so is the Hessian
  bool recorded_ = false;    ///< it is in the histories
  std::vector<double> difference_, momentum_, gradient_, step_, mass_step_, trial_;
  std::vector<double> y_, y_step_, y_trial_, hessian_;
  double gradient_norm_ = 0.0, scale_ = 0.0, residual_ = 0.0;
  double contraction_ = 1.0;  ///< residual after over that before the last step
  Totals totals_;
};

}  // namespace counterpoint::contact
