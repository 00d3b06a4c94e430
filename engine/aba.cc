#include "counterpoint/engine/aba.h"

#include <Eigen/Cholesky>

#include "counterpoint/engine/joint_motion.h"

namespace counterpoint {
namespace {

Vector6 stack(const Force& f) {
  Vector6 s;
  s << f.torque, f.force;
  return s;
}

/// Joints of one coordinate: S is a unit vector, revolute the angular z axis, prismatic the linear.
/// Leaves the inertia and bias force seen through the joint in IA, pA.
bool reduce_single(bool revolute, double tau, double diagonal, const Motion& c, bool has_parent,
                   ArticulatedInertia& IA, Force& pA, Motion& U, double& D_inv, double& u) {
  if (revolute) {
    U.angular = IA.angular.col(2);
    U.linear = IA.coupling.row(2).transpose();
  } else {
    U.angular = IA.coupling.col(2);
    U.linear = IA.linear.col(2);
  }
  const double D = (revolute ? U.angular.z() : U.linear.z()) + diagonal;
  if (!(D > 0.0)) return false;
  D_inv = 1.0 / D;
  u = tau - (revolute ? pA.torque.z() : pA.force.z());
  if (!has_parent) return true;
  const Vector3 angular = U.angular * D_inv, linear = U.linear * D_inv;
  IA.angular.noalias() -= angular * U.angular.transpose();
  IA.coupling.noalias() -= angular * U.linear.transpose();
  IA.linear.noalias() -= linear * U.linear.transpose();
  pA += IA * c;
  pA += Force{angular * u, linear * u};
  return true;
}

/// Joints of several coordinates, N of them.
template <int N>
bool reduce_multi(JointType type, const Matrix3& R_JB, const double* tau, const double* diagonal,
                  const Motion& c, bool has_parent, ArticulatedInertia& IA, Force& pA,
                  MultiDofFactor& factor) {
  Eigen::Matrix<double, 6, N> S;
  for (int j = 0; j < N; ++j) {
    const Motion axis = joint_axis(type, R_JB, j);
    S.col(j) << axis.angular, axis.linear;
  }
  const Matrix6 I = IA.matrix();
  const Eigen::Matrix<double, 6, N> U = I * S;
  Eigen::Matrix<double, N, N> D = S.transpose() * U;
  for (int j = 0; j < N; ++j) D(j, j) += diagonal[j];
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(D);
  if (llt.info() != Eigen::Success) return false;
  const Eigen::Matrix<double, N, N> D_inv = llt.solve(Eigen::Matrix<double, N, N>::Identity());
  const Eigen::Matrix<double, N, 1> u =
      Eigen::Map<const Eigen::Matrix<double, N, 1>>(tau) - S.transpose() * stack(pA);
  factor.U.leftCols<N>() = U;
  factor.D_inv.topLeftCorner<N, N>() = D_inv;
  factor.u.head<N>() = u;
  if (!has_parent) return true;
  const Eigen::Matrix<double, 6, N> UD = U * D_inv;
  const Matrix6 Ia = I - UD * U.transpose();
  IA.angular = Ia.topLeftCorner<3, 3>();
  IA.coupling = Ia.topRightCorner<3, 3>();
  IA.linear = Ia.bottomRightCorner<3, 3>();
  const Vector6 gain = UD * u;
  pA += IA * c;
  pA += Force{gain.head<3>(), gain.tail<3>()};
  return true;
}

template <int N>
void accelerate_multi(const MultiDofFactor& factor, const Motion& A, double* a) {
  Vector6 s;
  s << A.angular, A.linear;
  Eigen::Map<Eigen::Matrix<double, N, 1>> out(a);
  out = factor.D_inv.topLeftCorner<N, N>() *
        (factor.u.head<N>() - factor.U.leftCols<N>().transpose() * s);
}

Matrix3 rotation_if_needed(const Body& body, const Pose& X_PB) {
  return joint_axes_turn(body.joint_type) ? joint_rotation(body.X_PJ, X_PB) : Matrix3();
}

}  // namespace

bool aba(const Model& model, const VectorRef& tau, const VectorRef& extra, const Vector3& gravity,
         int body_begin, int body_end, Data& data, VectorOut a, int* singular_body) {
  for (int i = body_begin; i < body_end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    data.IA[i] = ArticulatedInertia::rigid(inertia);
    data.pA[i] = cross(data.V[i], inertia * data.V[i]);
    if (data.has_external) data.pA[i] -= data.external[i];
  }
  for (int i = body_end - 1; i >= body_begin; --i) {
    const Body& body = model.body(i);
    const int k = body.v_index;
    const bool has_parent = body.parent != 0;
    bool ok = false;
    double diagonal[6];
    for (int j = 0; j < joint_nv(body.joint_type); ++j) diagonal[j] = model.armature()[k + j] + extra[k + j];
    switch (body.joint_type) {
      case JointType::kRevolute:
      case JointType::kPrismatic:
        ok = reduce_single(body.joint_type == JointType::kRevolute, tau[k], diagonal[0], data.c[i],
                           has_parent, data.IA[i], data.pA[i], data.U[i], data.D_inv[i], data.u[i]);
        break;
      case JointType::kPlanar:
      case JointType::kSpherical:
        ok = reduce_multi<3>(body.joint_type, rotation_if_needed(body, data.X_PB[i]),
                             tau.data() + k, diagonal, data.c[i], has_parent, data.IA[i],
                             data.pA[i], data.multi[i]);
        break;
      case JointType::kFloating:
        ok = reduce_multi<6>(body.joint_type, rotation_if_needed(body, data.X_PB[i]),
                             tau.data() + k, diagonal, data.c[i], has_parent, data.IA[i],
                             data.pA[i], data.multi[i]);
        break;
    }
    if (!ok) {
      if (singular_body != nullptr) *singular_body = i;
      return false;
    }
    if (has_parent) {
      data.IA[body.parent] += data.IA[i].transformed(data.X_PB[i]);
      data.pA[body.parent] += data.X_PB[i] * data.pA[i];
    }
  }
  data.A[0] = {Vector3::Zero(), -gravity};
  for (int i = body_begin; i < body_end; ++i) {
    const Body& body = model.body(i);
    double* a_i = a.data() + body.v_index;
    Motion A = data.X_PB[i].inverse_apply(data.A[body.parent]) + data.c[i];
    switch (body.joint_type) {
      case JointType::kRevolute:
      case JointType::kPrismatic: {
        const Motion& U = data.U[i];
        a_i[0] = data.D_inv[i] * (data.u[i] - U.angular.dot(A.angular) - U.linear.dot(A.linear));
        break;
      }
      case JointType::kPlanar:
      case JointType::kSpherical: accelerate_multi<3>(data.multi[i], A, a_i); break;
      case JointType::kFloating: accelerate_multi<6>(data.multi[i], A, a_i); break;
    }
    data.A[i] = A + joint_motion(body.joint_type, rotation_if_needed(body, data.X_PB[i]), a_i);
  }
  return true;
}

}  // namespace counterpoint
