#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"

#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"

namespace counterpoint {
namespace {

/// Calls visit(k, A) for each rotation of a quaternion joint: A (3x3) is P or Q of its coordinates
/// k ... k + 2.
template <class Visit>
void for_each_rotation(const Model& model, RotationMap map, const VectorRef& r, Visit visit) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kSpherical && body.joint_type != JointType::kFloating)
      continue;
    const int k = body.v_index + joint_num_linear(body.joint_type);
    const Vector3 turn = r.segment<3>(k);
    visit(k, map == RotationMap::kQ ? right_jacobian(turn)
                                    : Matrix3(quaternion_exp(-turn).toRotationMatrix()));
  }
}

}  // namespace

void multiply_columns(const Model& model, RotationMap map, const VectorRef& r,
                      Eigen::Ref<MatrixX> m) {
  for_each_rotation(model, map, r, [&](int k, const Matrix3& A) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      const Eigen::RowVector3d row = m.block<1, 3>(i, k);
      m.block<1, 3>(i, k) = row * A;
    }
  });
}

void multiply_rows(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m) {
  for_each_rotation(model, map, r, [&](int k, const Matrix3& A) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      const Vector3 column = m.block<3, 1>(k, j);
      m.block<3, 1>(k, j) = A * column;
    }
  });
}

void add_map(const Model& model, RotationMap map, const VectorRef& r, Eigen::Ref<MatrixX> m) {
  m.diagonal().array() += 1.0;
  for_each_rotation(model, map, r, [&](int k, const Matrix3& A) {
    m.block<3, 3>(k, k) += A - Matrix3::Identity();
  });
}

}  // namespace counterpoint
