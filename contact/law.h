// The law of one constraint: impulse, potential, Hessian as functions of contact-space velocity.
//
// Friction cone. With z = (y_N, mu_1 y_1, mu_2 y_2, ...), tau = |z_T|, t = z_T / tau and the scalar
// law g, a of scalar_law.h at the two eigenvalues lambda+- = z_N +- tau, regularizer rho (below),
// smoothing k:
//
//   f_N = (g+ + g-) / 2            b = (g+ + g-) / (s+ + s-) = (g- - g+) / (2 tau)
//   f_i = -mu_i b z_i              l = (p(lambda+) + p(lambda-)) / 2
//
// and the Hessian in z: normal-normal and radial-radial (a+ + a-)/2, normal-radial (a+ - a-)/2,
// transverse b. This is the scalar function g applied spectrally on the second-order cone (Jordan
// algebra); f minimizes 1/2 f'R f + f'y + k barrier(cone), R_N = rho, R_i = rho / mu_i^2. Nothing
// is divided by tau or by mu: without friction the normal row is the unilateral law.
//
// Exact Coulomb friction (`coulomb`, coulomb.h): the normal impulse is that of the normal velocity
// alone, f_N = g(y_N), and friction the clamp of -z_T / rho to it, smoothed. It has no potential:
// G has a column of f_T by y_N and no row of f_N by y_T.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// f(y) [N s], `law.rows` long. y [m/s] includes the bias. Works for every law and friction model;
/// This is the whole inverse of one constraint.
Rows impulse(const Law& law, const Rows& y);

/// The same on plain arrays of `law.rows` numbers, for inner loops.
void impulse(const Law& law, const double* y, double* f);

struct Evaluation {
  double potential = 0.0;  ///< l [J], grad l = -f; NaN for `coulomb`, which has none
  Rows impulse;            ///< f [N s]
  RowsSquare hessian;      ///< G = -df/dy [kg]; symmetric positive semidefinite unless `coulomb`
};

/// l, f and G at y.
Evaluation evaluate(const Law& law, const Rows& y);

/// f and G = -df/dy on plain arrays; G is rows x rows, row by row.
void evaluate(const Law& law, const double* y, double* f, double* hessian);

/// l(y) [J]; NaN for `coulomb`.
double potential(const Law& law, const double* y);

struct Slope {
  double first = 0.0;   ///< -f . d
  double second = 0.0;  ///< d' G d
};
/// First and second derivative of l along d at y (`coulomb`: of the power -f . d).
Slope slope(const Law& law, const double* y, const double* d);

/// |z_T| = |(mu_1 y_1, mu_2 y_2, ...)| [m/s]: what De Saxce's form of exact Coulomb friction adds
/// to the normal velocity, and what a lagged bias takes from the last velocity.
double de_saxce_shift(const Law& law, const double* y);

/// Rows, regularizer, smoothing, friction and bound make sense for the type: a law one can solve.
bool is_valid(const Law& law);
/// No NaN and no infinity in it.
bool is_finite(const Law& law);

/// How much softer than its own a law is.
struct Softness {
  double factor = 1.0;  ///< of the regularizer
  bool convex = false;  ///< friction is the convex law's
  bool any() const { return factor != 1.0 || convex; }
  bool operator==(const Softness&) const = default;
};
/// The law, softer.
Law soften(const Law& law, const Softness& softness);

/// Friction coefficients below this no longer harden the normal row.
inline constexpr double kMinRegularizingFriction = 0.1;
/// rho [1/kg], the normal regularizer of a cone: mu^2 r with mu = max(friction[0], 0.1), so that
/// R_T = r sets the creep; a smaller mu would drive the normal row below what round-off can
/// resolve.
double normal_regularizer(const Law& law);
/// v of a Coulomb cone in the coordinates of coulomb.h: mu slip_speed, mu the first of `friction`.
double scaled_slip_speed(const Law& law);

}  // namespace counterpoint::contact
