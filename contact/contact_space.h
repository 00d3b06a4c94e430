// Contact without bodies: (A, c, mu) -> (f, v) and (A, v, mu) -> (f, c), v = c + A f.
//
// A is factored as L L' by pivoted Cholesky, as far as its rank goes; with M = I, J = L, b = c the
// contact problem in generalized velocity is then the one in contact space, and w = L' f.
#pragma once

#include <vector>

#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

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
