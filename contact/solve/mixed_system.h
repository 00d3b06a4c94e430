// One island's equations in velocity and impulse together, widened by smoothing: what the mixed
// Newton method solves.
//
// A law of regularizer rho at the velocity z is the law of any larger regularizer sigma at
// x = z - (sigma - rho) phi, exactly and at any smoothing k:
//
//     phi = F_rho(z)   <=>   phi = F_sigma(x)
//
// (z = D y, phi = inv(D) f, D = diag(1, mu_1, ...), as in problem.h), because rho phi + z is a
// function of phi alone in every law. With sigma near the inverse mass of the contact the kinks of
// F_sigma are as wide as the velocities are, while those of F_rho are narrower by eps, so Newton's
// method on
//
//     M (w - w*) = J'D phi,     phi = F_sigma(z(w) - (sigma - rho) phi)
//
// sees from afar which contacts stick, slide and open. phi is eliminated one constraint at a time,
// so a step factors the same M + J'GJ as Newton's method on velocities does, with G = D B A D,
// A = -F_sigma', B = inv(1 - (sigma - rho) A). At the solution G is the Hessian of the law itself.
// The method is that of Alart and Curnier ("A mixed formulation for frictional contact problems
// prone to Newton like solution methods", 1991), here for regularized and smoothed laws.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solve/mixed_lanes.h"
#include "counterpoint/contact/solve/wide_law.h"

namespace counterpoint::contact {

class MixedSystem {
 public:
  struct Point {
    std::vector<double> w;    ///< velocities of the island
    std::vector<double> phi;  ///< scaled impulses, by rows
    void reserve(const IslandSystem& system);
    /// Goes `step` times d further.
    void add(double step, const Point& d);
  };

  /// Takes the memory that an island needs, so that a method that is seldom tried does not allocate
  /// in the middle of a run.
  void reserve(const IslandSystem& system);

  /// Takes the island with its laws as they are now. sigma_share: sigma as a share of the inverse
  /// mass at the constraint.
  void begin(IslandSystem& system, double sigma_share);
  /// Smoothing [J] added to that of every law.
  double center = 0.0;

  /// phi of the impulses f [N s]; where the first row of a constraint is NaN those that would stop
  /// the constraint by itself at the free velocity.
  void guess(const std::vector<double>& f, std::vector<double>& phi);
  /// Residuals of both equations, kept inside; returns their norm [sqrt J].
  double residual(const Point& point);
  /// Newton's method on k / phi no more than doubles phi in a step. Where a contact carries too
  /// little for the velocity of the last residual(), phi becomes what its law says, `most` times as
  /// much at most. True if any does.
  bool raise_loads(double most, Point& point) const;
  /// The same at the point of the last residual() or accept() with another center: only the laws
  /// are evaluated.
  double recenter(const Point& point, double other_center);
  /// Sum over constraints of sigma |F_sigma - phi|^2 [J], of the last residual.
  double law_square() const { return law_square_; }
  /// Scale of the terms of the last residual [sqrt J], as Report has it.
  double scale() const { return scale_; }
  /// Number of constraints.
  int num_laws() const {
    return lanes_[0].count() + lanes_[1].count() + static_cast<int>(laws_.size());
  }

  /// Factors the derivative at the last residual's point. False if singular.
  bool factor();
  /// Newton's direction for the last residual, with the last factors.
  void direction(Point& out);
  /// Norm of the residual `step` along the last direction d, from the laws alone: that of momentum
  /// is linear. Then accept() goes where the last trial was and computes what it left out.
  double trial(const Point& point, const Point& d, double step);
  double accept(const Point& d, Point& point);

 private:
  double evaluate_laws(const double* y, const double* phi);
  double momentum_residual(const Point& point);

  IslandSystem* system_ = nullptr;
  MixedLanes lanes_[2];        ///< of contacts with exact and with convex friction
  std::vector<WideLaw> laws_;  ///< every law but those that lanes_ have
  double law_square_ = 0.0, dual_square_ = 0.0, scale_ = 0.0, step_ = 0.0;
  // Residuals, negated: of momentum, and of the laws in phi.
  std::vector<double> dual_, error_;
  std::vector<double> scales_;  ///< D, by rows
  std::vector<double> y_, f_, momentum_, hessian_, rhs_, dy_, y_trial_, phi_trial_;
};

}  // namespace counterpoint::contact
