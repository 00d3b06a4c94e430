// Newton solver for the contact problem: problem in, next velocity and impulses out.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Speed and accuracy only; never the physics (that is in the Problem).
struct Settings {
  /// Converged when the residual |M(w+ - w*) - J'f|, in the norm of inv(diag M), is below this times
  /// the scale of its terms.
  double tolerance = 1e-10;
  int max_iterations = 100;
};

enum class Status {
  kConverged,
  kRoundoffFloor,   ///< as accurate as doubles allow at this compliance, above the tolerance asked for
  kMaxIterations,
  kLineSearchFailed,
  kNotFinite,       ///< NaN or infinity in the problem
  kSingular,        ///< mass matrix not positive definite
};
const char* status_name(Status status);
/// True if the result may be used: converged, or at the round-off floor.
bool succeeded(Status status);

struct Report {
  Status status = Status::kConverged;
  int iterations = 0;            ///< Newton steps, the largest over the islands
  double residual = 0.0;         ///< relative, at the end, the largest over the islands
  std::vector<double> residual_history;  ///< of the island with most iterations
};

/// Scratch memory inside: one per thread. The result is a pure function of the arguments.
class Solver {
 public:
  Solver();
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  /// w: start on entry (the last velocity, say), w+ on return, also when not converged. impulse: f,
  /// all rows. No allocation once sizes have been seen.
  const Report& solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                      VectorX& impulse);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::contact
