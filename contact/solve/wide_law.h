// One constraint's law, widened (mixed_system.h), with its derivatives.
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/island_system.h"

namespace counterpoint::contact {

/// rho of a law: the regularizer of its first row, before it is widened [1/kg].
double own_regularizer(const Law& law);

struct WideLaw {
  /// -F' or inv(1 - (sigma - rho) A) in the directions of normal and friction: lower triangular in
  /// (normal, radial), a multiple of one across the radial direction.
  struct Operator {
    double normal = 0.0, radial = 0.0, across = 0.0;
    double radial_normal = 0.0, normal_radial = 0.0;
  };

  /// sigma of the normal [1/kg]; that of friction follows from it.
  WideLaw(const IslandSystem::Constraint& c, double sigma_of_normal);
  /// Other sigmas, not below rho.
  void widen(double normal, double friction);
  double wide(int r) const { return r > 0 ? sigma_T : sigma; }

  /// x becomes F_sigma(x) at a smoothing larger by `center` [J]; A and t are those at x.
  void evaluate(double center, double* x);
  /// The same, but A and t may stay what they were.
  void impulse(double center, double* x);
  void apply(const Operator& op, const double* x, double* out) const;
  /// The impulse f [N s] of scaled impulses phi, linearly; both `rows` numbers, and may be the
  /// same.
  void unscale(const double* phi, double* f) const {
    for (int r = 0; r < rows; ++r) f[r] = scale[r] * phi[r];
    lean_impulse(*law, f);
  }
  /// inv(1 - (sigma - rho) A).
  Operator widening() const;

  const Law* law;
  int row, rows, hessian;
  double rho = 0.0, sigma = 0.0, sigma_T = 0.0;
  double scale[kMaxRows];   ///< D
  double t[kMaxRows] = {};  ///< unit, friction part of x; t[0] unused
  Operator A, B;

 private:
  void evaluate_cone(double k, double* x);
};

}  // namespace counterpoint::contact
