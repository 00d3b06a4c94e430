#include "counterpoint/engine/optimize/optimize.h"

#include "counterpoint/engine/optimize/newton/continuation.h"

namespace counterpoint::optimization {

const char* outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kConverged:
      return "converged";
    case Outcome::kInfeasible:
      return "infeasible";
    case Outcome::kIterations:
      return "iterations";
    case Outcome::kStopped:
      return "stopped";
  }
  return "";
}

Result optimize(const Problem& problem, const std::vector<VectorX>& start,
                const Settings& settings) {
  check_problem(problem);
  return Continuing(problem, start, settings).run();
}

}  // namespace counterpoint::optimization
