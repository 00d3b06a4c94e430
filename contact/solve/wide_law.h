// Law of one constraint, widened (mixed_system.h), with its derivatives.
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/island_system.h"

namespace counterpoint::contact {

/// Returns rho of a law [1/kg]: the regularizer of its first row, before it is widened.
double own_regularizer(const Law& law);

struct WideLaw {
  /// -F' or inv(1 - (sigma - rho) A) in the directions (normal, radial), and a multiple of the
  /// identity across the radial direction. normal_radial is zero for exact friction.
  struct Operator {
    double normal = 0.0, radial = 0.0, across = 0.0;
    double radial_normal = 0.0, normal_radial = 0.0;
  };

  /// sigma_of_normal: sigma of the normal row [1/kg]; that of friction follows from it.
  WideLaw(const IslandSystem::Constraint& c, double sigma_of_normal);
  /// Sets other sigmas [1/kg], not below rho.
  void widen(double normal, double friction);
  double wide(int r) const { return r > 0 ? sigma_T : sigma; }

  /// Replaces x by F_sigma(x) at a smoothing larger by `extra_smoothing` [J]; A and t are those at
  /// x.
  void evaluate(double extra_smoothing, double* x);
  /// Same, but A and t may stay unchanged.
  void impulse(double extra_smoothing, double* x);
  void apply(const Operator& op, const double* x, double* out) const;
  /// Computes the impulse f [N s] of scaled impulses phi, a linear map; both are `rows` long and
  /// may be the same array.
  void unscale(const double* phi, double* f) const {
    for (int r = 0; r < rows; ++r) f[r] = scale[r] * phi[r];
    lean_impulse(*law, f);
  }
  /// Returns inv(1 - (sigma - rho) A).
  Operator widening() const;

  const Law* law;
  int row, rows, hessian;
  double rho = 0.0, sigma = 0.0, sigma_T = 0.0;
  double scale[kMaxRows];   ///< D
  double t[kMaxRows] = {};  ///< unit vector along the friction part of x; t[0] unused
  Operator A, B;

 private:
  void evaluate_cone(double k, double* x);
};

}  // namespace counterpoint::contact
