// Derivatives of the law in closed form, for optimization through contact.
#pragma once

#include "counterpoint/contact/law.h"

namespace counterpoint::contact {

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
