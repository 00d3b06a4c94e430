// Newton solver for the contact problem: problem in, next velocity and impulses out. The same for
// contacts given as matrices, without bodies.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// How M + J'GJ is stored and factored: as one dense matrix an island, or by velocity blocks.
enum class Factorization { kAutomatic, kDense, kSparse };

/// How an island was solved; each is tried where those before it did not do.
enum class Method {
  kVelocity,  ///< Newton's method on velocities, from the start
  kMixed,     ///< mixed Newton from the impulses given, in turn with sweeps of Gauss and Seidel
  kSofter,    ///< with softer laws
};
const char* method_name(Method method);

/// Speed and accuracy only; never the physics (that is in the Problem).
struct Settings {
  /// Converged when Report::residual is at most this.
  double tolerance = 1e-12;
  int max_iterations = 10000;  ///< Newton steps, per island, softer laws included
  /// Newton steps after which an island is solved with softer laws (Status::kSoftened); 0: never,
  /// what cannot be solved then fails.
  int soften_after = 160;
  bool warm = false;  ///< the impulses given to solve() are a guess
  /// For tests and measurements: one method, all islands as one, how M + J'GJ is stored.
  std::optional<Method> only;  ///< this method alone, finished by Newton's
  bool split_islands = true;
  Factorization factorization = Factorization::kAutomatic;

  bool operator==(const Settings&) const = default;
};

enum class Status {
  kConverged,
  kRoundoffFloor,  ///< as accurate as doubles allow at this compliance, above the tolerance
  kSoftened,       ///< solved with softer laws, see Report::softened
  kMaxIterations,
  kNoProgress,  ///< no method came further, above the round-off floor
  kNotFinite,   ///< NaN or infinity in the problem
  kSingular,    ///< mass matrix not positive definite
  kInvalidLaw,  ///< regularizer not positive; negative smoothing, friction or bound; wrong rows
  // of whole steps, never of this solver (FaultKind in engine/step.h says more)
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
  /// Newton steps, the largest over the islands, and summed over them. Counted are factorizations:
  /// steps with the factors of an earlier one are among the evaluations.
  int iterations = 0, total_iterations = 0;
  int islands = 0;  ///< islands with constraints
  int line_search_evaluations = 0;
  Method method = Method::kVelocity;  ///< the last one tried, the hardest over the islands
  /// Islands solved with softer laws: a block of each, and how much softer.
  struct Softened {
    int block;
    Softness softness;
  };
  std::vector<Softened> softened;
  double residual = 0.0;  ///< relative, at the end, the largest over the islands
  /// Relative, where Newton's method on velocities was; steps of other methods are counted, not
  /// listed; of the island with most steps.
  std::vector<double> residual_history;
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

// ---- Contact without bodies: (A, c, mu) -> (f, v) and (A, v, mu) -> (f, c), v = c + A f.
//
// A is factored as L L' by pivoted Cholesky, as far as its rank goes; with M = I, J = L, b = c the
// contact problem in generalized velocity is then the one in contact space, and w = L' f.

/// Point contacts with rows (normal, t1, t2); normal first, as everywhere.
struct ContactSpaceProblem {
  MatrixX A;  ///< 3n x 3n, symmetric positive semidefinite [1/kg]; only its symmetric part is used
  VectorX c;  ///< 3n, contact velocity without contact impulses [m/s]
  std::vector<double> mu;  ///< n, Coulomb coefficients

  int num_contacts() const { return static_cast<int>(mu.size()); }
};

struct ContactSpaceOptions {
  bool coulomb = false;  ///< exact Coulomb friction; else the convex law
  double compliance =
      1e-8;                ///< eps: r of a contact is eps times the mean diagonal of its block of A
  double smoothing = 0.0;  ///< k of every contact [N m]
  /// Pivots of A below this share of their own diagonal entry count as zero.
  double rank_tolerance = 1e-14;
};

struct ContactSpaceSolution {
  VectorX f;  ///< 3n, impulses [N s]
  /// 3n, the velocity [m/s] at which the law gives f to the bit: c + A f but for the solver's
  /// residual, which 1 / r would amplify if f were computed from c + A f again.
  VectorX v;
  Report report;
  int rank = 0;            ///< of A
  double asymmetry = 0.0;  ///< largest |A - A'| over the largest |A|: what symmetrising changed
};

/// The law of a contact: the regularizer comes from its block of A. What forward and inverse share.
Law contact_law(const ContactSpaceProblem& problem, const ContactSpaceOptions& options,
                int contact);

/// |A - A'| over |A|, largest entries.
double relative_asymmetry(const MatrixX& A);

/// Solves for f and v. Errors are in the report: kNotFinite for NaN, kInvalidLaw for sizes or mu
/// that make no sense. Laws are never softened, whatever the settings say: the inverse knows those
/// of `options` alone.
ContactSpaceSolution solve_contact_space(const ContactSpaceProblem& problem,
                                         const ContactSpaceOptions& options,
                                         const Settings& settings);

/// The inverse: impulses that make contact velocity v, and the c they explain. Closed form. The
/// options must be those of the forward problem.
struct ContactSpaceInverse {
  VectorX f;  ///< 3n [N s]
  VectorX c;  ///< 3n, v - A f [m/s]
};
ContactSpaceInverse invert_contact_space(const ContactSpaceProblem& problem, const VectorX& v,
                                         const ContactSpaceOptions& options);

/// Distances from the hard laws, computed from A, c, f alone (v = c + A f): no part of the solver
/// is used.
struct ContactSpaceResiduals {
  double primal = 0.0;  ///< largest distance of f from the friction cone, over the largest |f|
  double dual = 0.0;    ///< of v (+ shift) from the dual cone, over the largest |c|
  double complementarity = 0.0;  ///< largest |f . (v + shift)|, over the product of both scales
};
ContactSpaceResiduals contact_space_residuals(const ContactSpaceProblem& problem, const VectorX& f,
                                              bool coulomb);

}  // namespace counterpoint::contact
