// The inverse of a whole Problem, the check of any answer against the hard laws, and the laws'
// derivatives.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// f(J w + b) [N s] of all rows at next velocity w: closed form, one constraint at a time. No mass
/// matrix, no optimization; the solver calls the same law.
void compute_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& w, VectorX& impulse);

/// y = J w + b [m/s] of all rows, summed in the order in which solver and inverse sum it.
void compute_constraint_velocity(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                                 VectorX& y);

/// J'f [N s, N m s]: what the constraints did to the generalized momentum.
void compute_generalized_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& impulse,
                                 VectorX& out);

/// How far (w, f) is from the hard laws, each the worst over constraints, with y = J w + b, De
/// Saxce's shift added to y_N where the law is `coulomb`; in the scaled coordinates phi_i = f_i /
/// mu_i, z_i = mu_i y_i in which every cone is |phi_T| <= phi_N. These bound the distances to the
/// cones from above.
struct Residuals {
  double primal = 0.0;           ///< violation of f in the cone [N s]
  double dual = 0.0;             ///< violation of y in the dual cone; of y = 0 for equalities [m/s]
  double complementarity = 0.0;  ///< |f . y|; friction rows of dry joints: F |y| + f y [J]
  double motion = 0.0;           ///< |M(w - w*) - J'f| in the norm of inv(diag M) [sqrt(J)]
  double force_scale = 0.0;      ///< largest |f_i| [N s]
  double velocity_scale = 0.0;   ///< largest |y_i| of w and of w* [m/s]
  /// (|M(w - w*)|^2 + sum_c |J_c'f_c|^2)^1/2, norm and sum as in Report.
  double momentum_scale = 0.0;
};
Residuals compute_residuals(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                            const VectorX& impulse);

// ---- Derivatives of the law in closed form, for optimization through contact.

/// How f(y) changes with everything it depends on. A gap enters through the bias, d bias / d gap =
/// 1 / h (or beta / h), so that `velocity` column 0 serves for it.
struct Sensitivity {
  RowsSquare velocity;  ///< df/dy = df/db = -G [kg]
  RowsSquare friction;  ///< df/d friction[j], column j of rows - 1; for mu below
                        ///< kMinRegularizingFriction with rho fixed
  Rows smoothing;       ///< df/dk
  Rows regularizer;     ///< df/dr
  Rows slip_speed;      ///< df/dv of a Coulomb cone, zero of others [kg]
  Rows bound;           ///< df/dF of dry friction, else zero
};

/// Needs k > 0 for `smoothing` and `regularizer` to be finite at the corners of the hard law.
Sensitivity compute_sensitivity(const Law& law, const Rows& y);

/// df/d slip_speed alone.
Rows slip_speed_derivative(const Law& law, const Rows& y);

}  // namespace counterpoint::contact
