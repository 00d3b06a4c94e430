// Derivatives of configuration differences: linear maps between tangent spaces that couple only the
// coordinates of a rotation.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::optimization {

/// Indices into v where the angular velocities of spherical and floating joints start.
std::vector<int> rotation_starts(const Model& model);

/// An nv x nv matrix that is diagonal except for 3 x 3 blocks at the rotations.
struct TangentMap {
  VectorX diagonal;             ///< nv; ignored where there is a block
  std::vector<Matrix3> blocks;  ///< in the order of rotation_starts

  void set_identity(int nv, std::size_t rotations);
  TangentMap& operator*=(double scale);
  TangentMap& operator+=(const TangentMap& other);
};

/// Adds dense * map to out (rows x nv each).
void add_product(const Eigen::Ref<const MatrixX>& dense, const TangentMap& map,
                 const std::vector<int>& rotations, Eigen::Ref<MatrixX> out);

/// Derivatives of d = configuration_difference(q_from, q_to), given d (nv), with respect to changes
/// theta of either configuration in its own tangent space, q (+) theta. For a rotation vector d:
/// the inverse of the right Jacobian of SO(3) for q_to, and minus the inverse of the left Jacobian
/// for q_from (Chirikjian, Stochastic Models II, 2012, eq. 10.86).
void differentiate_difference(const VectorRef& d, const std::vector<int>& rotations,
                              TangentMap& by_from, TangentMap& by_to);

}  // namespace counterpoint::optimization
