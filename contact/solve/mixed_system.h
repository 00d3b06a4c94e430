// One island's equations in velocity and impulse together, with widened laws: the system that the
// mixed Newton method solves.
//
// A law with regularizer rho at the velocity z is the law with any larger regularizer sigma at
// x = z - (sigma - rho) phi, exactly and at any smoothing k (dry friction: only for k = 0):
//
//     phi = F_rho(z)   <=>   phi = F_sigma(x)
//
// (z = D y, phi = inv(D) f, D = diag(1, mu_1, ...), as in problem.h), because rho phi + z is a
// function of phi alone. With sigma near the inverse mass of the contact, the kinks of F_sigma are
// as wide as the velocities are, while those of F_rho are narrower by the factor eps. Newton's
// method on
//
//     M (w - w*) = J'D phi,     phi = F_sigma(z(w) - (sigma - rho) phi)
//
// therefore detects from afar which contacts stick, slide and open. phi is eliminated one
// constraint at a time, so a step factors the same M + J'GJ as Newton's method on velocities does,
// with G = D B A D, A = -F_sigma', B = inv(1 - (sigma - rho) A). At the solution G is the Hessian
// of the law itself. The method is that of Alart and Curnier ("A mixed formulation for frictional
// contact problems prone to Newton like solution methods", 1991), here for regularized and smoothed
// laws.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/wide_laws.h"

namespace counterpoint::contact {

class MixedSystem {
 public:
  struct Point {
    std::vector<double> w;    ///< velocities of the island [m/s, rad/s]
    std::vector<double> phi;  ///< scaled impulses, by rows [N s]
    void reserve(const IslandSystem& system);
    /// Adds step times d.
    void add(double step, const Point& d);
  };

  /// Reserves the memory that an island needs, so that a rarely used method does not allocate in
  /// the middle of a run.
  void reserve(const IslandSystem& system);

  /// Takes the island with its present laws. sigma_share: ratio of sigma to the inverse mass at the
  /// constraint.
  void begin(IslandSystem& system, double sigma_share);
  /// Smoothing [J] added to that of every law.
  double extra_smoothing = 0.0;

  /// Computes phi of the impulses f [N s]; a constraint whose first row is NaN gets the impulses
  /// that would stop it by itself at the free velocity.
  void guess(const std::vector<double>& f, std::vector<double>& phi);
  /// Evaluates the residuals of both equations, kept inside; returns their norm [sqrt J].
  double residual(const Point& point);
  /// Raises loads that are too small, since Newton's method on k / phi at most doubles phi in a
  /// step. Where the load of a contact is too small for the velocity of the last residual(), phi
  /// becomes that of its law. True if any load changes.
  bool raise_loads(Point& point) const;
  /// Sets extra_smoothing [J] and returns the norm of the residual with it [sqrt J], at the point
  /// of the last residual() or accept(): only the laws are evaluated.
  double resmooth(const Point& point, double other_smoothing);
  /// Sum over constraints of sigma |F_sigma - phi|^2 [J], of the last residual.
  double law_square() const { return law_square_; }
  /// Impulses f of the last residual, by rows [N s].
  const std::vector<double>& impulses() const { return f_; }
  /// Part of the impulses of the last residual() that dissipates most, for a point with
  /// w = w* + inv(M) J'f. With t f the kinetic energy becomes that of w* plus D(t) - t f'b,
  ///   D(t) = t f'(J w* + b) + t^2 / 2 |w - w*|_M^2.
  /// The share t in [0, 1] with the least D has D <= 0: bodies gain no more energy than the biases
  /// demand. Friction cones and bounds hold t f with f. D is the cost that rigid contacts minimize.
  struct Dissipation {
    double share = 0.0;
    double cost = 0.0;  ///< D [J]
  };
  Dissipation dissipation(const Point& point) const;
  /// Scale of the terms of the last residual [sqrt J], as in Report.
  double scale() const { return scale_; }
  /// Number of constraints.
  int num_laws() const { return static_cast<int>(system_->constraints().size()); }

  /// Factors the derivative at the point of the last residual. False if singular.
  bool factor();
  /// Computes Newton's direction for the last residual with the last factors.
  void direction(Point& out);
  /// Returns the norm of both residuals at `step` along the last direction d; only the laws are
  /// evaluated, since the momentum residual is linear in the step. accept() moves `point` to the
  /// last trial and returns its norm.
  double trial(const Point& point, const Point& d, double step);
  double accept(const Point& d, Point& point);

 private:
  double evaluate_laws(const double* y, const double* phi);
  double momentum_residual(const Point& point);

  IslandSystem* system_ = nullptr;
  WideLaws laws_;
  double law_square_ = 0.0, dual_square_ = 0.0, scale_ = 0.0, step_ = 0.0;
  std::vector<double> dual_;    ///< negated residual of momentum
  std::vector<double> scales_;  ///< D, by rows
  std::vector<double> y_, f_, momentum_, hessian_, rhs_, dy_, y_trial_, phi_trial_;
};

}  // namespace counterpoint::contact
