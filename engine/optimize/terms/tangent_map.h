// Derivatives of configuration differences: linear maps between tangent spaces that mix only the
// coordinates of a rotation.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::optimization {

/// Where in v the angular velocities of spherical and floating joints begin.
std::vector<int> rotation_starts(const Model& model);

/// A matrix nv x nv: diagonal, but for 3 x 3 blocks at the rotations.
struct TangentMap {
  VectorX diagonal;             ///< nv; not looked at where a block is
  std::vector<Matrix3> blocks;  ///< by rotation_starts

  void set_identity(int nv, std::size_t rotations);
  TangentMap& operator*=(double scale);
  TangentMap& operator+=(const TangentMap& other);
};

/// out += dense * map (rows x nv each).
void add_product(const Eigen::Ref<const MatrixX>& dense, const TangentMap& map,
                 const std::vector<int>& rotations, Eigen::Ref<MatrixX> out);

/// Derivatives of d = configuration_difference(q_from, q_to), given d (nv), for changes of either
/// configuration in its own tangent space, q (+) theta. With d a rotation vector, of q_to the
/// inverse of the right Jacobian of SO(3), of q_from that of the left one, negative (Chirikjian,
/// Stochastic Models II, 2012, eq. 10.86).
void differentiate_difference(const VectorRef& d, const std::vector<int>& rotations,
                              TangentMap& by_from, TangentMap& by_to);

}  // namespace counterpoint::optimization
