// Solves one island by a sequence of methods, and by softer laws where none of them finds the
// solution (README.md, The solver).
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
    double residual = 0.0;              ///< relative, as Report says
    Method method = Method::kVelocity;  ///< that solved it, or the last one tried
    Softness softness;                  ///< of the laws solved
  };

  /// w: start on entry, answer on return, the best point seen if there is none. f: impulses guessed
  /// on entry, NaN in the first row of a constraint where nothing is known; those at w on return.
  /// Both in the island's numbering. The system's laws are those that were solved.
  Result solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
               std::vector<double>& f);
  const Newton::Totals& totals() const { return newton_.totals(); }

 private:
  void begin(IslandSystem& system, const Settings& settings, const std::vector<double>& w,
             const std::vector<double>& guess);
  bool run(Method method);
  bool run_velocity();
  bool run_mixed();
  bool run_near(int max_iterations);
  bool run_path(int max_iterations);
  bool run_from_nothing();
  bool sweeps_pay() const;
  bool run_softer();
  void walk_back();
  double softer_factor() const;
  bool solve_softer(double factor, int max_iterations);
  bool finish(int max_iterations, double contraction = 1.0);
  bool resume(int max_iterations);
  bool keep_best();
  bool finish_mixed(const MixedNewton::Result& result);
  void start_mixed(double sigma);
  double residual();
  double smoothing(double share);
  void sweep(int count, double enough);
  int allowed(int steps) const;
  void set_softness(Softness softness);

  Newton newton_;
  MixedSystem mixed_system_;
  MixedNewton mixed_newton_;
  Sweeps sweeps_;

  IslandSystem* system_ = nullptr;
  double tolerance_ = 0.0;
  bool exact_ = false;      ///< softer laws are no answer
  int budget_ = 0;          ///< Newton steps in all, so far granted
  int max_iterations_ = 0;  ///< and at most
  Softness softness_;
  Newton::Result last_, best_;
  std::vector<double> start_, guess_, w_, f_, best_w_, best_f_, own_best_w_;
  std::vector<Law> own_;  ///< the laws that were given
  MixedSystem::Point point_, here_;
};

}  // namespace counterpoint::contact
