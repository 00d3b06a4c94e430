// How q (+) r moves: by P dq + Q dr, which are identities but for rotations of quaternions, where P
// = exp(-r) and Q is the right Jacobian of the exponential map.
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

enum class RotationMap { kP, kQ };

/// m A and A m, with A = P or Q at r (nv); in place.
void multiply_columns(const Model& model, RotationMap map, const VectorRef& r,
                      Eigen::Ref<MatrixX> m);
void multiply_rows(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m);
/// Adds A (nv x nv).
void add_map(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m);

}  // namespace counterpoint
