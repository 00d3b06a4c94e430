// Inverse contact dynamics of a whole Problem, residuals of any answer against the hard laws, and
// derivatives of the laws.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Computes the impulses f(J w + b) [N s] of all rows at the next velocity w (num_velocities), in
/// closed form, one constraint at a time; resizes `impulse` to num_rows. It needs no mass matrix
/// and no optimization; the solver calls the same law.
void compute_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& w, VectorX& impulse);

/// Computes y = J w + b [m/s] of all rows, in the order of summation of solver and inverse.
void compute_constraint_velocity(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                                 VectorX& y);

/// Computes J'f [N s, N m s] (num_velocities): the change of generalized momentum by the
/// constraints.
void compute_generalized_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& impulse,
                                 VectorX& out);

/// Distances of (w, f) from the hard laws, each the largest over the constraints, with y = J w + b;
/// where the law is `coulomb`, De Saxce's shift is added to y_N. Cones are measured in the scaled
/// coordinates phi_i = f_i / mu_i, z_i = mu_i y_i, in which every cone is |phi_T| <= phi_N. These
/// values bound the distances to the cones from above.
struct Residuals {
  double primal = 0.0;           ///< violation of the cone (f >= 0, |f| <= F) by f [N s]
  double dual = 0.0;             ///< violation of the dual cone by y; |y| for equalities [m/s]
  double complementarity = 0.0;  ///< |f . y|; dry friction: |F |y| + f y| [J]
  double motion = 0.0;           ///< |M(w - w*) - J'f| in the norm of inv(diag M) [sqrt(J)]
  double force_scale = 0.0;      ///< largest |f_i| [N s]
  double velocity_scale = 0.0;   ///< largest |y_i| at w and at w* [m/s]
  /// (|M(w - w*)|^2 + sum_c |J_c'f_c|^2)^1/2 [sqrt(J)], with norm and sum as in Report.
  double momentum_scale = 0.0;
};
/// Computes the residuals; w: num_velocities, impulse: num_rows.
Residuals compute_residuals(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                            const VectorX& impulse);

// ---- Derivatives of the law in closed form, for optimization through contact.

/// Derivatives of f(y) with respect to y and to the parameters of the law. A gap enters through the
/// bias, d bias / d gap = 1 / h (or beta / h), so column 0 of `velocity` also gives its derivative.
struct Sensitivity {
  RowsSquare velocity;  ///< df/dy = df/db = -G [kg], rows x rows
  RowsSquare friction;  ///< df/d friction[j] in column j, rows x (rows - 1); rho is constant in mu
                        ///< below kMinRegularizingFriction
  Rows smoothing;       ///< df/dk
  Rows regularizer;     ///< df/dr
  Rows normal;          ///< df/dR_N, R_N the regularizer of the first row; one-sided laws only
  Rows slip_speed;      ///< df/d slip_speed of a Coulomb cone, zero for other laws [kg]
  Rows bound;           ///< df/dF of dry friction, zero for other laws
};

/// Computes all derivatives at y [m/s], law.rows numbers. At the corners of the hard law (k = 0)
/// `smoothing` is huge.
Sensitivity compute_sensitivity(const Law& law, const Rows& y);

/// Computes df/d slip_speed [kg] alone.
Rows slip_speed_derivative(const Law& law, const Rows& y);

}  // namespace counterpoint::contact
