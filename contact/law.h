// The law of one constraint: impulse, potential, Hessian as functions of contact-space velocity.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// f(y) [N s], `law.rows` long. y [m/s] includes the bias. Works for every law and friction model;
/// `coulomb` applies De Saxce's shift inside. This is the whole inverse of one constraint.
Rows impulse(const Law& law, const Rows& y);

}  // namespace counterpoint::contact
