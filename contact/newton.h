// Newton's method on the next velocity of one island whose laws all have a potential.
#pragma once

#include <vector>

#include "counterpoint/contact/island_system.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

class Newton {
 public:
  struct Result {
    Status status = Status::kConverged;
    int iterations = 0;
    int line_search_evaluations = 0;
    double residual = 0.0;
  };
  /// w: start on entry, answer on return; f: impulses at w. Both in the island's numbering.
  Result solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
               std::vector<double>& f);

  const std::vector<double>& residual_history() const { return residual_history_; }
  const std::vector<double>& cost_history() const { return cost_history_; }

 private:
  void resize(const IslandSystem& system);
  double cost(const std::vector<double>& w, const std::vector<double>& y);
  void choose_start(std::vector<double>& w);
  void evaluate(const std::vector<double>& w, std::vector<double>& f);
  double roundoff_floor(const std::vector<double>& w);
  bool compute_direction();
  bool advance(std::vector<double>& w, int* evaluations);

  IslandSystem* system_ = nullptr;
  std::vector<double> difference_, momentum_, gradient_, step_, mass_step_, trial_;
  std::vector<double> y_, y_step_, y_trial_, hessian_;
  double gradient_norm_ = 0.0, scale_ = 0.0;
  std::vector<double> residual_history_, cost_history_;
};

}  // namespace counterpoint::contact
