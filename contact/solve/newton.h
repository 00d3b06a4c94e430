// Newton's method on the next velocity of one island, at the present smoothing of its laws.
//
// Without Coulomb laws the residual M(w - w*) - J'f(Jw + b) is the gradient of a convex cost:
// Cholesky, and a line search for the zero of its component along the direction, which fails only
// by round-off. With Coulomb laws it is not a gradient: LU, and steps halved until its norm falls.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/line_search.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

/// Relative residual below which a point is near a solution: Newton's method on velocities goes on
/// from it, and the mixed method does not give it up.
inline constexpr double kNearSolution = 0.3;

/// Number of steps of a solve for which histories reserve memory.
inline constexpr std::size_t kUsualHistory = 256;

class Newton {
 public:
  struct Result {
    Status status = Status::kConverged;
    int iterations = 0;
    double residual = 0.0;  ///< relative, as in Report
  };
  struct Totals {
    int iterations = 0;
    int line_search_evaluations = 0;
    std::vector<double> residual_history;
  };

  /// Begins with an island: sizes the memory and resets the totals.
  void begin(IslandSystem& system);
  /// Replaces w by the free velocity if that has the smaller residual: the last velocity is a good
  /// start for a contact at rest, the free one for a flight. loaded: a constraint is known to carry
  /// a load, so that it is no flight. f: memory for the impulses. resume() then starts there.
  void choose_start(bool loaded, std::vector<double>& w, std::vector<double>& f);
  /// Takes at most `max_iterations` factorizations towards a relative residual of `tolerance`. w:
  /// start on entry, answer on return; f: impulses at w. contraction: expected share of the
  /// residual after a step with the system's present factors; 1 where they are of no use.
  Result run(double tolerance, int max_iterations, std::vector<double>& w, std::vector<double>& f,
             double contraction = 1.0);
  /// Continues where the last run() or choose_start() ended, with its w, f and laws, without
  /// another evaluation.
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
  bool evaluated_ = false;   ///< the residual kept inside is that of the present point
  bool linearized_ = false;  ///< the Hessian, too
  bool recorded_ = false;    ///< the residual is in the history
  std::vector<double> difference_, momentum_, gradient_, step_, mass_step_, trial_;
  std::vector<double> y_, y_step_, y_trial_, hessian_;
  double gradient_norm_ = 0.0, scale_ = 0.0, residual_ = 0.0;
  double contraction_ = 1.0;  ///< residual after the last step over that before
  Totals totals_;
};

}  // namespace counterpoint::contact
