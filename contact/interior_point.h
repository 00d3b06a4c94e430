// Primal-dual interior point for one island: impulse and slack are kept as unknowns of their own,
// so that the number of steps hardly depends on how many contacts change between open, stick and
// slip.
//
// In the scaled coordinates of law.h, z = D y with D = diag(1, mu_1, ...), phi = inv(D) f, every
// inequality law is the Jordan-algebra equation
//
//     phi o s = k e,     s = z + rho phi,     phi, s in the second-order cone
//
// (a unilateral row is the cone of one dimension). A step linearizes it with Nesterov and Todd's
// scaling W, W phi = inv(W) s = lambda, and predicts and corrects after Mehrotra:
//
//     M dw - J'D dphi = -r_d,   ds = D J dw + rho dphi + r_p,   ds + W^2 dphi = W (lambda \ d)
//
// which condenses to the same matrix as Newton's, M + J'GJ, with G = D inv(W^2 + rho) D. Coulomb
// laws add De Saxce's shift to z and its slope to G. Laws without a cone (equality, dry friction)
// enter through their closed form.
//
// Source: Nesterov and Todd 1997; Mehrotra 1992; Vandenberghe, "The CVXOPT linear and quadratic
// cone program solvers", 2010, for the cone formulas.
#pragma once

#include <vector>

#include "counterpoint/contact/island_system.h"
#include "counterpoint/contact/jordan.h"

namespace counterpoint::contact {

class InteriorPoint {
 public:
  /// At most `max_iterations` steps from w towards the solution at the smoothing of the laws.
  /// Leaves in w a point from which Newton's method converges; w is left alone where that fails.
  /// Returns the number of steps, negative if it failed.
  int run(IslandSystem& system, int max_iterations, std::vector<double>& w);
  /// Impulses of the last run that did not fail [N s].
  const std::vector<double>& impulses() const { return f_; }

  /// Takes the memory that an island needs, so that a method that is seldom tried does not allocate
  /// in the middle of a run.
  void reserve(const IslandSystem& system);

 private:
  struct Cone {
    int row = 0, rows = 1, hessian = 0;
    int constraint = 0;
    double rho = 0.0, k = 0.0;
    double scale[kMaxRows] = {};  ///< D
    double t[kMaxRows] = {};      ///< unit, friction part of the scaling point; t[0] unused
    double slope[kMaxRows] = {};  ///< of De Saxce's shift with respect to z_T; zero if convex
    Spectral W, inverse;          ///< W, and inv(W^2 + rho)
    double determinant = 0.0;     ///< of lambda
  };

  void begin(IslandSystem& system, const std::vector<double>& w);
  bool scale_cone(Cone& cone);
  void residuals(const std::vector<double>& w);
  bool factor();
  void direction(bool corrector, double center);
  double longest_step() const;
  double central_step(double step, double gap, double target) const;
  double complementarity() const;

  IslandSystem* system_ = nullptr;
  std::vector<Cone> cones_;
  double center_ = 0.0;  ///< smoothing for laws without a cone on the way
  double dual_norm_ = 0.0, dual_scale_ = 0.0;
  std::vector<double> w_, y_, f_, s_, phi_, lambda_, primal_, rhs_;
  std::vector<double> ds_, dphi_, dw_, dy_, hessian_, dual_, momentum_, push_;
};

}  // namespace counterpoint::contact
