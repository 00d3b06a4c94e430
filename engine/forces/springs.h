// Springs in joints, implicit: the force at the coordinate with which the step ends.
//
//   f = -k (q + h w+ - q_ref)
//
// Stable at any stiffness. Forward, with w+ = w + h a: k (q + h w - q_ref) is known, h^2 k stands
// on the diagonal of M. Inverse: w+ is known, so f is. Of a lone spring implicit Euler takes energy
// in every step, never gives any.
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

/// What the springs add to M, onto `diagonal` [kg, kg m^2], and to the force at the start of the
/// step, onto `tau` [N, N m]; both nv. h [s].
void add_springs(const Model& model, double h, const VectorRef& q, const VectorRef& w,
                 VectorOut diagonal, VectorOut tau);

/// The force that the springs took up in a step that ends with w_next, onto tau (nv) [N, N m].
void add_springs_inverse(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                         VectorOut tau);

/// Energy in the springs [J].
double spring_energy(const Model& model, const VectorRef& q);

}  // namespace counterpoint
