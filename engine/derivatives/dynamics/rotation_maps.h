// Derivative of q (+) r: it is displaced by P dq + Q dr. P and Q are identities except for
// rotations of quaternion joints, where P = exp(-r) and Q is the right Jacobian of the exponential
// map.
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

enum class RotationMap { kP, kQ };

/// Replace m by m A (multiply_columns) or A m (multiply_rows), with A = P or Q at r (nv).
void multiply_columns(const Model& model, RotationMap map, const VectorRef& r,
                      Eigen::Ref<MatrixX> m);
void multiply_rows(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m);
/// Adds A = P or Q at r to m (nv x nv).
void add_map(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m);

}  // namespace counterpoint
