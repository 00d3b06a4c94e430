#include "counterpoint/engine/optimize/terms/tangent_map.h"

#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {
namespace {

/// The inverse of the right Jacobian of SO(3) at a rotation vector [rad] of less than one turn.
Matrix3 inverse_right_jacobian(const Vector3& r) {
  const double angle2 = r.squaredNorm();
  // Below 1e-2 rad its series is used; the next term is angle^4 / 30240 < 4e-13.
  double c = 1.0 / 12.0 + angle2 / 720.0;
  if (angle2 > 1e-4) {
    const double angle = std::sqrt(angle2);
    c = (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / angle2;
  }
  const Matrix3 K = skew(r);
  return Matrix3::Identity() + 0.5 * K + c * K * K;
}

}  // namespace

std::vector<int> rotation_starts(const Model& model) {
  std::vector<int> starts;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type == JointType::kSpherical) starts.push_back(body.v_index);
    if (body.joint_type == JointType::kFloating) starts.push_back(body.v_index + 3);
  }
  return starts;
}

void TangentMap::set_identity(int nv, std::size_t rotations) {
  diagonal.setOnes(nv);
  blocks.assign(rotations, Matrix3::Identity());
}

TangentMap& TangentMap::operator*=(double scale) {
  diagonal *= scale;
  for (Matrix3& block : blocks) block *= scale;
  return *this;
}

TangentMap& TangentMap::operator+=(const TangentMap& other) {
  diagonal += other.diagonal;
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] += other.blocks[i];
  return *this;
}

void add_product(const Eigen::Ref<const MatrixX>& dense, const TangentMap& map,
                 const std::vector<int>& rotations, Eigen::Ref<MatrixX> out) {
  std::size_t next = 0;
  for (Eigen::Index j = 0; j < dense.cols();) {
    if (next < rotations.size() && rotations[next] == j) {
      out.middleCols<3>(j) += dense.middleCols<3>(j).lazyProduct(map.blocks[next++]);
      j += 3;
    } else {
      out.col(j) += map.diagonal[j] * dense.col(j);
      ++j;
    }
  }
}

void differentiate_difference(const VectorRef& d, const std::vector<int>& rotations,
                              TangentMap& by_from, TangentMap& by_to) {
  by_to.diagonal.setOnes(d.size());
  by_from.diagonal.setConstant(d.size(), -1.0);
  by_to.blocks.resize(rotations.size());
  by_from.blocks.resize(rotations.size());
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    by_to.blocks[i] = inverse_right_jacobian(d.segment<3>(rotations[i]));
    by_from.blocks[i] = -by_to.blocks[i].transpose();
  }
}

}  // namespace counterpoint::optimization
