// Newton solver of the contact problem: from a Problem to the next velocity and the impulses. Also
// for contacts given as matrices (A, c, mu), without bodies.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

class ThreadPool;

/// Storage and factorization of M + J'GJ: one dense matrix per island, or sparse by velocity
/// blocks.
enum class Factorization { kAutomatic, kDense, kSparse };

/// Method that solved an island; each is tried if those before it failed.
enum class Method {
  kVelocity,  ///< Newton's method on velocities, from the given velocity or w*
  kMixed,     ///< mixed Newton from the given impulses, alternating with Gauss-Seidel sweeps
  kSofter,    ///< with softer laws
  kStop,      ///< none: sweeps, then the impulses found so far, see Settings::stop_after
};
const char* method_name(Method method);

/// Settings of speed and accuracy. The physics is in the Problem; only soften_after and stop_after
/// can change the laws obeyed, which Report::softened and Report::unfinished tell.
struct Settings {
  /// Converged when Report::residual is at most this [-].
  double tolerance = 1e-12;
  int max_iterations = 10000;  ///< largest number of Newton steps per island, softer laws included
  /// Newton steps after which an island is solved with softer laws (Status::kSoftened); 0: never,
  /// an unsolved island then fails.
  int soften_after = 160;
  /// Newton steps after which an island ends with impulses that obey their laws only roughly
  /// (Status::kUnfinished): within their friction cones, with w = w* + inv(M) J'f, and without gain
  /// of energy, see contact/README.md. 0: never. It replaces soften_after, unless that is 0.
  int stop_after = 0;
  bool warm = false;  ///< the impulses given to solve() are an initial guess
  /// For tests and measurements: a single method, all islands as one, storage of M + J'GJ.
  std::optional<Method> only;  ///< this method alone, refined by Newton's on velocities
  bool split_islands = true;
  Factorization factorization = Factorization::kAutomatic;

  bool operator==(const Settings&) const = default;
};

enum class Status {
  kConverged,
  kRoundoffFloor,  ///< above the tolerance, but as accurate as doubles allow at this compliance
  kSoftened,       ///< solved with softer laws, see Report::softened
  kUnfinished,     ///< stopped before it was solved, see Settings::stop_after
  kMaxIterations,
  kNoProgress,  ///< no method reduced the residual further, above the round-off floor
  kNotFinite,   ///< NaN or infinity in the problem
  kSingular,    ///< mass matrix not positive definite
  kInvalidLaw,  ///< regularizer not positive; negative smoothing, friction or bound; wrong rows
  // Statuses of whole steps, never of this solver (FaultKind in engine/step.h says more):
  kInvalidState,  ///< a quaternion is not of unit length
  kDiverged,      ///< a velocity exceeds SimulationOptions::max_speed
};
const char* status_name(Status status);
/// Returns whether the result may be used: converged, at the round-off floor, softened, unfinished.
bool succeeded(Status status);

/// Impulses are resolved to the tolerance times this share of the momentum, see Report.
inline constexpr double kMomentumShare = 1e-2;

/// Result of a solve. Residuals are |M(w+ - w*) - J'f(J w+ + b)| relative to the scale of its
/// terms,
///   scale^2 = |M(w+ - w*)|^2 + sum_c |J_c' f_c|^2 + kMomentumShare^2 (|w+|^2 + |w*|^2)_M,
/// with impulses in the norm of inv(diag M), velocities in that of diag M, and c over constraints.
/// The last term means that no impulse is resolved better than 1e-14 of the momentum. Each island
/// has its own residual and scale.
struct Report {
  Status status = Status::kConverged;
  /// Newton steps, counted by factorizations: largest over the islands, and summed over them. Steps
  /// that reuse earlier factors are counted in line_search_evaluations.
  int iterations = 0, total_iterations = 0;
  int islands = 0;  ///< number of islands with constraints
  int line_search_evaluations = 0;
  Method method = Method::kVelocity;  ///< last method tried, the latest over the islands
  /// Islands solved with softer laws: the lowest block of each, and its softness.
  struct Softened {
    int block;
    Softness softness;
  };
  std::vector<Softened> softened;
  /// Unfinished islands: the lowest block of each. Their residual is that of momentum and laws for
  /// velocities and impulses together, over the same scale.
  std::vector<int> unfinished;
  double residual = 0.0;  ///< relative, at the end, the largest over the islands
  /// Relative residuals of Newton's method on velocities in the island with the most steps; steps
  /// of other methods are counted but not listed.
  std::vector<double> residual_history;
};

/// Contact solver with scratch memory: use one per thread. The result is a pure function of the
/// arguments.
class Solver {
 public:
  Solver();
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  /// Lets the threads of a pool, which must outlive this solver, solve islands side by side, to the
  /// same bits; null, as at first: the calling thread alone. Memory of a thread grows at the
  /// largest island that it has solved.
  void use(ThreadPool* pool);

  /// Solves the problem. w (num_velocities): start on entry, for instance the last velocity; w+ on
  /// return, also if not converged. impulse (num_rows): f on return; with Settings::warm a guess on
  /// entry, for instance that of the last step, NaN in the first row of constraints without one.
  /// Errors are in Report::status; an invalid problem leaves w unchanged and f zero. There is no
  /// allocation once the largest sizes have occurred.
  const Report& solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                      Eigen::Ref<VectorX> impulse);
  /// Same; resizes `impulse` to num_rows, which allocates when that number changes.
  const Report& solve(const Problem& problem, const Settings& settings, Eigen::Ref<VectorX> w,
                      VectorX& impulse);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// ---- Contact without bodies: (A, c, mu) -> (f, v) and (A, v, mu) -> (f, c), v = c + A f.
//
// A is factored as L L' by pivoted Cholesky up to its rank. With M = I, J = L and b = c the contact
// problem in generalized velocity equals the one in contact space, and w = L' f.

/// Point contacts with the rows (normal, t1, t2).
struct ContactSpaceProblem {
  MatrixX A;  ///< Delassus matrix, 3n x 3n, symmetric positive semidefinite [1/kg]; only its
              ///< symmetric part is used
  VectorX c;  ///< contact velocity without contact impulses, 3n [m/s]
  std::vector<double> mu;  ///< Coulomb coefficients, n [-]

  int num_contacts() const { return static_cast<int>(mu.size()); }
};

struct ContactSpaceOptions {
  bool coulomb = false;  ///< regularized Coulomb friction; false: the convex law
  double compliance =
      1e-8;  ///< eps [-]: r of a contact is eps times the mean diagonal of its block of A
  double smoothing = 0.0;  ///< k of every contact [N m]
  /// A pivot of A below this share of its own diagonal entry counts as zero.
  double rank_tolerance = 1e-14;
};

struct ContactSpaceSolution {
  VectorX f;  ///< impulses, 3n [N s]
  /// Velocity, 3n [m/s], at which the law gives f to the bit: c + A f up to the solver's residual,
  /// which 1 / r would amplify if f were computed from c + A f again.
  VectorX v;
  Report report;
  int rank = 0;            ///< rank of A
  double asymmetry = 0.0;  ///< largest |A - A'| over the largest |A|, before A is symmetrized
};

/// Returns the law of a contact, the same for forward and inverse; its regularizer follows from its
/// block of A.
Law contact_law(const ContactSpaceProblem& problem, const ContactSpaceOptions& options,
                int contact);

/// Returns the largest |A - A'| over the largest |A|.
double relative_asymmetry(const MatrixX& A);

/// Solves for f and v. Errors are in the report: kNotFinite for NaN or infinity, kInvalidLaw for
/// sizes that disagree or an inadmissible mu. Laws are never softened, whatever the settings: the
/// inverse knows only the laws of `options`.
ContactSpaceSolution solve_contact_space(const ContactSpaceProblem& problem,
                                         const ContactSpaceOptions& options,
                                         const Settings& settings);

/// Result of the inverse in closed form: the impulses at the contact velocity v and the c that they
/// imply. The options must be those of the forward problem.
struct ContactSpaceInverse {
  VectorX f;  ///< impulses, 3n [N s]
  VectorX c;  ///< v - A f, 3n [m/s]
};
ContactSpaceInverse invert_contact_space(const ContactSpaceProblem& problem, const VectorX& v,
                                         const ContactSpaceOptions& options);

/// Distances from the hard laws, computed from A, c and f alone (v = c + A f) without any part of
/// the solver. With exact friction the shift mu |v_T| is added to v_N.
struct ContactSpaceResiduals {
  double primal = 0.0;  ///< largest distance of f from the friction cone, over the largest |f|
  double dual = 0.0;  ///< largest distance of v (+ shift) from the dual cone, over the largest |c|
  double complementarity = 0.0;  ///< largest |f . (v + shift)|, over the product of both scales
};
ContactSpaceResiduals contact_space_residuals(const ContactSpaceProblem& problem, const VectorX& f,
                                              bool coulomb);

}  // namespace counterpoint::contact
