// One island's equations in velocity and impulse together, widened by smoothing and with De Saxce's
// shift turned down: what the mixed Newton method and the homotopy solve.
//
// A law of regularizer rho at the velocity z is the law of any larger regularizer sigma at
// x = z - (sigma - rho) phi, exactly and at any smoothing:
//
//     rho phi + z = k inv(phi)   <=>   sigma phi + x = k inv(phi)   <=>   phi = F_sigma(x)
//
// (z = D y, phi = inv(D) f, D = diag(1, mu_1, ...), as in law.h.) With sigma near the inverse mass
// of the contact the kinks of F_sigma are as wide as the velocities are, while those of F_rho are
// narrower by eps, so Newton's method on
//
//     M (w - w*) = J'D phi,     phi = F_sigma(z(w) - (sigma - rho) phi)
//
// sees from afar which contacts stick, slide and open. phi is eliminated one constraint at a time,
// so a step factors the same M + J'GJ as before, with G = D B A S D, A = -F_sigma',
// B = inv(1 - (sigma - rho) A), S the derivative of the shifted z. At the solution G is the Hessian
// of the law itself. The method is that of Alart and Curnier ("A mixed formulation for frictional
// contact problems prone to Newton like solution methods", 1991), here for regularized and smoothed
// laws on any cone.
#pragma once

#include <vector>

#include "counterpoint/contact/island_system.h"
#include "counterpoint/contact/jordan.h"

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

  /// sigma as a share of the inverse mass at the constraint, unless told otherwise.
  static constexpr double kSigma = 0.2;

  /// Takes the island; nothing is smoothed beyond its laws, the shift is whole. detour: see center.
  void begin(IslandSystem& system, double sigma_share = kSigma, int detour = 0);
  /// Smoothing [J] added to that of the laws, times a weight between 1/4 and 4 of each constraint
  /// that depends on the detour (all 1 for detour 0); and the share of De Saxce's shift in use.
  double center = 0.0;
  double share = 1.0;

  /// Impulses that would stop each constraint by itself at the free velocity.
  void guess(std::vector<double>& phi);
  /// phi = inv(D) f of impulses f [N s]; 0 in directions without friction.
  void scale_impulses(const std::vector<double>& f, std::vector<double>& phi) const;
  /// Sum over constraints of sigma |phi|^2 [J].
  double impulse_square(const std::vector<double>& phi) const;
  /// Residuals of both equations, kept inside; returns their norm [sqrt J].
  double residual(const Point& point);
  /// Sum over constraints of sigma |F_sigma - phi|^2 [J], of the last residual.
  double law_square() const { return law_square_; }
  /// Scale of the terms of the last residual [sqrt J], as Report has it.
  double scale() const { return scale_; }
  /// Number of constraints with a cone.
  int num_cones() const { return static_cast<int>(cones_.size()); }

  /// Factors the derivative at the last residual's point. False if singular.
  bool factor();
  /// Sign of the derivative's determinant, 1 or -1.
  double determinant_sign() const { return system_->determinant_sign(); }
  /// Newton's direction for the last residual, with the last factors.
  void direction(Point& out);
  /// Derivative of the residuals with respect to a parameter, by a difference: call `residual` at
  /// the same point with the parameter changed by `difference`, then this.
  void remember();
  void sensitivity(double difference, Point& out);

  /// <a, b> in the metric of diag M and sigma [J].
  double inner(const Point& a, const Point& b) const;

 private:
  struct Cone {
    LawType type = LawType::kUnilateral;
    bool coulomb = false;
    int row = 0, rows = 1, hessian = 0;
    double rho = 0.0, sigma = 0.0, k = 0.0, bound = 0.0;
    double weight = 1.0;          ///< of center
    double scale[kMaxRows] = {};  ///< D
    double t[kMaxRows] = {};      ///< unit, friction part of x; t[0] unused
    double slope[kMaxRows] = {};  ///< of the shift with respect to z
    Spectral A, B;
  };
  void scaled_velocity(Cone& cone, const double* y, double* z) const;
  void evaluate(Cone& cone, double* x) const;
  void solve(const std::vector<double>& dual, const std::vector<double>& error, Point& out);

  IslandSystem* system_ = nullptr;
  std::vector<Cone> cones_;
  double law_square_ = 0.0, scale_ = 0.0;
  // Residuals, negated: of momentum, and of the laws in phi; and the same remembered.
  std::vector<double> dual_, error_, dual_before_, error_before_;
  std::vector<double> y_, f_, momentum_, hessian_, rhs_, dy_;
};

}  // namespace counterpoint::contact
