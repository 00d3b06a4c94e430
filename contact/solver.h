// Newton solver for the contact problem: problem in, next velocity and impulses out.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/contact/law.h"

namespace counterpoint::contact {

/// How M + J'GJ is stored and factored: as one dense matrix an island, or by velocity blocks.
enum class Factorization { kAutomatic, kDense, kSparse };

/// How an island was solved; each is tried where those before it did not do.
enum class Method {
  kVelocity,   ///< Newton's method on velocities, from the start
  kWarm,       ///< mixed Newton from the impulses that were given
  kSmoothing,  ///< mixed Newton, smoothed on the way
  kPath,       ///< mixed Newton along the path of falling smoothing
  kSofter,     ///< with softer laws
};
const char* method_name(Method method);

/// Speed and accuracy only; never the physics (that is in the Problem).
struct Settings {
  /// Converged when Report::residual is at most this.
  double tolerance = 1e-12;
  int max_iterations = 10000;  ///< Newton steps, per island, softer laws included
  /// Newton steps after which an island is solved with softer laws (Status::kSoftened); 0: never,
  /// what cannot be solved then fails.
  int soften_after = 120;
  bool warm = false;  ///< the impulses given to solve() are a guess
  /// For tests and measurements: one method, all islands as one, how M + J'GJ is stored.
  std::optional<Method> only;  ///< this method alone, finished by Newton's
  bool split_islands = true;
  Factorization factorization = Factorization::kAutomatic;

  bool operator==(const Settings&) const = default;
};

enum class Status {
  kConverged,
  kRoundoffFloor,  ///< as accurate as doubles allow at this compliance, above the tolerance asked
                   ///< for
  kSoftened,       ///< solved with softer laws, see Report::softened
  kMaxIterations,
  kNoProgress,  ///< no method came further, above the round-off floor
  kNotFinite,   ///< NaN or infinity in the problem
  kSingular,    ///< mass matrix not positive definite
  kInvalidLaw,  ///< regularizer not positive; negative smoothing, friction or bound; wrong rows
  // of whole steps, never of this solver (engine/fault.h says more)
  kInvalidState,  ///< a quaternion that is not of unit length
  kDiverged,      ///< faster than any motion of the scene is meant to be
};
const char* status_name(Status status);
/// True if the result may be used: converged, at the round-off floor, or softened.
bool succeeded(Status status);

/// An impulse is resolved to the tolerance times this share of the momentum, see Report.
inline constexpr double kMomentumShare = 1e-2;

/// Residuals are |M(w+ - w*) - J'f(J w+ + b)| relative to the scale of its terms,
///   scale^2 = |M(w+ - w*)|^2 + sum_c |J_c' f_c|^2 + kMomentumShare^2 (|w+|^2 + |w*|^2)_M,
/// impulses in the norm of inv(diag M), velocities in that of diag M, c over constraints. The last
/// term says that no impulse is resolved better than 1e-14 of the momentum. Each island by itself.
struct Report {
  Status status = Status::kConverged;
  int iterations = 0;        ///< Newton steps, the largest over the islands
  int total_iterations = 0;  ///< Newton steps, summed over the islands
  int islands = 0;           ///< islands with constraints
  int line_search_evaluations = 0;
  Method method = Method::kVelocity;  ///< the last one tried, the hardest over the islands
  /// Islands solved with softer laws: a block of each, and how much softer.
  struct Softened {
    int block;
    Softness softness;
  };
  std::vector<Softened> softened;
  double residual = 0.0;  ///< relative, at the end, the largest over the islands
  std::vector<double>
      residual_history;  ///< relative, where Newton's method on velocities was; steps of other
                         ///< methods are counted, not listed; island with most steps
};

/// Scratch memory inside: one per thread. The result is a pure function of the arguments.
class Solver {
 public:
  Solver();
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  /// w: start on entry (the last velocity, say), w+ on return, also when not converged. impulse:
  /// num_rows long; a guess on entry (those of the last step, say) where Settings::warm, NaN in the
  /// first row of constraints without one; f on return. No allocation once sizes have been seen.
  const Report& solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                      Eigen::Ref<VectorX> impulse);
  /// The same; resizes `impulse` to all rows, which allocates when their number changes.
  const Report& solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                      VectorX& impulse);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::contact
