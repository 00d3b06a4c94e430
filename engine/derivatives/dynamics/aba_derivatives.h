// Derivatives of forward dynamics: those of inverse dynamics at the acceleration it gives, times
// -inv(M).
#pragma once

#include "counterpoint/engine/derivatives/dynamics/rnea_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"

namespace counterpoint {

/// Scratch of one thread for one model.
class AbaDerivator {
 public:
  explicit AbaDerivator(const Model& model) : rnea_(model), parents_(coordinate_parents(model)) {}

  /// At an acceleration a (nv) that aba gave with these arguments; the rest as RneaDerivator. False
  /// if M + diagonal (nv, constant, not negative) is singular. Nothing is allocated once `out` has
  /// its size.
  bool compute(const Model& model, const VectorRef& v, const VectorRef& a,
               const VectorRef& diagonal, const Vector3& gravity, const Kinematics& data,
               AbaDerivatives& out);  // Parameters: what it depends on, one by one
  /// Those of inverse dynamics that it went by.
  const RneaDerivatives& inverse() const { return inverse_; }

 private:
  RneaDerivator rnea_;
  RneaDerivatives inverse_;
  SparseSolver solver_;
  std::vector<int> parents_;
};

}  // namespace counterpoint
