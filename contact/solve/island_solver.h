// Solver of one island: a sequence of methods, then softer laws if none of them finds the solution
// (README.md, The solver).
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/mixed_newton.h"
#include "counterpoint/contact/solve/mixed_system.h"
#include "counterpoint/contact/solve/newton.h"
#include "counterpoint/contact/solve/sweeps.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

class IslandSolver {
 public:
  struct Result {
    Status status = Status::kConverged;
    int iterations = 0;
    double residual = 0.0;              ///< relative, as in Report
    Method method = Method::kVelocity;  ///< method that solved it, or the last one tried
    Softness softness;                  ///< softness of the laws solved
  };

  /// Solves an island. w: start on entry; solution on return, or the best point seen if there is
  /// none. f: guessed impulses on entry, NaN in the first row of a constraint without a guess;
  /// impulses at w on return. Both are in the island's numbering. On return the system's laws are
  /// those that were solved.
  Result solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
               std::vector<double>& f);
  const Newton::Totals& totals() const { return newton_.totals(); }

 private:
  void begin(IslandSystem& system, const Settings& settings, const std::vector<double>& w,
             const std::vector<double>& guess);
  bool is_loaded() const;
  bool run(Method method);
  bool run_velocity();
  bool run_mixed();
  bool run_near(int max_iterations);
  bool run_path(int max_iterations);
  bool sweeps_pay() const;
  bool run_softer();
  void stop();
  MixedSystem::Dissipation dissipation();
  void walk_back();
  double softer_factor() const;
  bool solve_softer(double factor, int max_iterations);
  bool finish(int max_iterations, double contraction = 1.0);
  bool resume(int max_iterations);
  bool keep_best();
  bool finish_mixed(const MixedNewton::Result& result);
  void start_mixed();
  double residual();
  double smoothing(double share);
  double negligible() const;
  /// Runs `count` sweeps on point_ unless its relative residual is below `enough`; restarts it
  /// from start_ and guess_ if it is not finite.
  void sweep(int count, double enough);
  int allowed(int steps) const;
  void set_softness(Softness softness);

  Newton newton_;
  MixedSystem mixed_system_;
  MixedNewton mixed_newton_;
  Sweeps sweeps_;

  IslandSystem* system_ = nullptr;
  double tolerance_ = 0.0;
  bool exact_ = false;      ///< neither softer laws nor an unfinished solution are allowed
  int budget_ = 0;          ///< Newton steps granted so far, in all
  int max_iterations_ = 0;  ///< limit of budget_
  Softness softness_;
  Newton::Result last_, best_;
  std::vector<double> start_, guess_, w_, f_, best_w_, best_f_, own_best_w_;
  std::vector<Law> own_;  ///< the given laws
  MixedSystem::Point point_, here_;
};

}  // namespace counterpoint::contact
