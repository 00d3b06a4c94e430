// Derivatives of forward dynamics: -inv(M + D) times the derivatives of inverse dynamics at the
// resulting acceleration.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/rnea_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"

namespace counterpoint {

/// Differentiates forward dynamics. Scratch memory inside: one object per thread and model.
class AbaDerivator {
 public:
  explicit AbaDerivator(const Model& model) : rnea_(model), parents_(coordinate_parents(model)) {}

  /// Computes the derivatives at an acceleration a (nv) [m/s^2, rad/s^2] that aba returned for
  /// these arguments; the others are those of RneaDerivator. Returns false if M + D is
  /// singular; D is diag(diagonal) (nv, constant, not negative). Nothing is allocated once `out`
  /// has its size.
  bool compute(const Model& model, const VectorRef& v, const VectorRef& a,
               const VectorRef& diagonal, const Vector3& gravity, const Data& data,
               AbaDerivatives& out);
  /// Derivatives of inverse dynamics at the last compute(), with M + D in `da`.
  const RneaDerivatives& inverse() const { return inverse_; }

 private:
  RneaDerivator rnea_;
  RneaDerivatives inverse_;
  SparseSolver solver_;
  std::vector<int> parents_;
};

}  // namespace counterpoint
