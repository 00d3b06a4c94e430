// Motion on the configuration manifold.
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

/// q_next = q (+) h v: translations along v, rotations by the exponential map, quaternions kept at
/// unit length. q, q_next: nq (may be the same memory); v: nv.
void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v, double h,
                             BodyRange bodies, VectorOut q_next);
inline void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v,
                                    double h, VectorOut q_next) {
  integrate_configuration(model, q, v, h, moving_bodies(model), q_next);
}

/// v (nv) such that q_to = q_from (+) v: the inverse, rotation angles in [0, pi].
void configuration_difference(const Model& model, const VectorRef& q_from, const VectorRef& q_to,
                              VectorOut v);

}  // namespace counterpoint
