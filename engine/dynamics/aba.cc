#include "counterpoint/engine/dynamics/aba.h"

#include <Eigen/Cholesky>

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3>;

Vector6 stack(const Vector3& a, const Vector3& b) {
  Vector6 s;
  s << a, b;
  return s;
}

/// Eliminates a joint of one coordinate: computes U, D_inv and u, and replaces IA and pA by the
/// articulated inertia and bias force that the parent sees. S is (axis, 0) for revolute, (0, axis)
/// for prismatic joints. Returns false if D = S' IA S + diagonal is not positive.
bool reduce_single(bool revolute, const Vector3& axis, double tau, double diagonal, const Motion& c,
                   bool has_parent, ArticulatedInertia& IA, Force& pA, Force& U, double& D_inv,
                   double& u) {
  if (revolute) {
    U = {IA.angular * axis, IA.coupling.transpose() * axis};
  } else {
    U = {IA.coupling * axis, IA.linear * axis};
  }
  const double D = axis.dot(revolute ? U.torque : U.force) + diagonal;
  if (!(D > 0.0)) return false;
  D_inv = 1.0 / D;
  u = tau - axis.dot(revolute ? pA.torque : pA.force);
  if (!has_parent) return true;
  const Vector3 torque = U.torque * D_inv, force = U.force * D_inv;
  IA.angular.noalias() -= torque * U.torque.transpose();
  IA.coupling.noalias() -= torque * U.force.transpose();
  IA.linear.noalias() -= force * U.force.transpose();
  pA += IA * c;
  pA += U * (D_inv * u);
  return true;
}

/// Eliminates a joint of three coordinates in the same way.
bool reduce_three(const Motion* axis, const double* tau, const double* diagonal, const Motion& c,
                  bool has_parent, ArticulatedInertia& IA, Force& pA, MultiDofFactor& factor) {
  Matrix63 S, U;
  for (int j = 0; j < 3; ++j) {
    const Force column = IA * axis[j];
    S.col(j) << axis[j].angular, axis[j].linear;
    U.col(j) << column.torque, column.force;
  }
  Matrix3 D;
  D.noalias() = S.transpose() * U;
  for (int j = 0; j < 3; ++j) D(j, j) += diagonal[j];
  const Eigen::LLT<Matrix3> llt(D);
  if (llt.info() != Eigen::Success) return false;
  const Matrix3 D_inv = llt.solve(Matrix3::Identity());
  const Vector3 u = Eigen::Map<const Vector3>(tau) - S.transpose() * stack(pA.torque, pA.force);
  factor.U.leftCols<3>() = U;
  factor.D_inv.topLeftCorner<3, 3>() = D_inv;
  factor.u.head<3>() = u;
  if (!has_parent) return true;
  const Matrix63 UD = U * D_inv;
  const Matrix6 Ia = IA.matrix() - UD * U.transpose();
  IA.angular = Ia.topLeftCorner<3, 3>();
  IA.coupling = Ia.topRightCorner<3, 3>();
  IA.linear = Ia.bottomRightCorner<3, 3>();
  const Vector6 gain = UD * u;
  pA += IA * c;
  pA += Force{gain.head<3>(), gain.tail<3>()};
  return true;
}

/// Eliminates a floating joint in the same way. Its S is orthogonal, so only rates and forces are
/// multiplied by it: with x = S a, (IA + S d S') x = S tau - pA - IA A, where d is the diagonal.
bool reduce_floating(const Motion* axis, const double* tau, const double* diagonal, const Motion& c,
                     bool has_parent, ArticulatedInertia& IA, Force& pA, MultiDofFactor& factor) {
  const Matrix6 inertia = IA.matrix();
  Matrix6 with_diagonal = inertia;
  for (int j = 0; j < 3; ++j) {
    const Vector3 &l = axis[j].linear, &w = axis[3 + j].angular;
    if (diagonal[j] != 0.0)
      with_diagonal.bottomRightCorner<3, 3>() += diagonal[j] * l * l.transpose();
    if (diagonal[3 + j] != 0.0)
      with_diagonal.topLeftCorner<3, 3>() += diagonal[3 + j] * w * w.transpose();
  }
  const Eigen::LLT<Matrix6> llt(with_diagonal);
  if (llt.info() != Eigen::Success) return false;
  factor.U = inertia;
  factor.D_inv = llt.matrixLLT();
  Vector3 torque = -pA.torque, force = -pA.force;
  for (int j = 0; j < 3; ++j) {
    force += axis[j].linear * tau[j];
    torque += axis[3 + j].angular * tau[3 + j];
  }
  factor.u << torque, force;
  if (!has_parent) return true;
  const Matrix6 Ia = inertia - inertia * llt.solve(inertia);
  IA.angular = Ia.topLeftCorner<3, 3>();
  IA.coupling = Ia.topRightCorner<3, 3>();
  IA.linear = Ia.bottomRightCorner<3, 3>();
  const Vector6 gain = inertia * llt.solve(factor.u);
  pA += IA * c;
  pA += Force{gain.head<3>(), gain.tail<3>()};
  return true;
}

void accelerate_floating(const Motion* axis, const MultiDofFactor& factor, const Motion& A,
                         double* a) {
  Vector6 x = factor.u - factor.U * stack(A.angular, A.linear);
  factor.D_inv.triangularView<Eigen::Lower>().solveInPlace(x);
  factor.D_inv.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  for (int j = 0; j < 3; ++j) a[j] = axis[j].linear.dot(x.tail<3>());
  for (int j = 3; j < 6; ++j) a[j] = axis[j].angular.dot(x.head<3>());
}

void accelerate_three(const MultiDofFactor& factor, const Motion& A, double* a) {
  Eigen::Map<Vector3> out(a);
  out.noalias() =
      factor.D_inv.topLeftCorner<3, 3>() *
      (factor.u.head<3>() - factor.U.leftCols<3>().transpose() * stack(A.angular, A.linear));
}

bool reduce_joint(const Model& model, int i, const VectorRef& tau, const VectorRef& joint_diagonal,
                  const BodyState& bodies) {
  const auto& [at, velocity, external, scratch] = bodies;
  const Body& body = model.body(i);
  const int k = body.v_index;
  const bool has_parent = body.parent != 0;
  const Motion* axis = &at.axis[k];
  const Motion& c = velocity_product(at, velocity, i);
  double diagonal[6];
  for (int j = 0; j < joint_nv(body.joint_type); ++j) diagonal[j] = joint_diagonal[k + j];
  switch (body.joint_type) {
    case JointType::kRevolute:
      return reduce_single(true, axis->angular, tau[k], diagonal[0], c, has_parent, scratch.IA[i],
                           scratch.pA[i], scratch.U[i], scratch.D_inv[i], scratch.u[i]);
    case JointType::kPrismatic:
      return reduce_single(false, axis->linear, tau[k], diagonal[0], c, has_parent, scratch.IA[i],
                           scratch.pA[i], scratch.U[i], scratch.D_inv[i], scratch.u[i]);
    case JointType::kPlanar:
    case JointType::kSpherical:
      return reduce_three(axis, tau.data() + k, diagonal, c, has_parent, scratch.IA[i],
                          scratch.pA[i], scratch.multi[i]);
    case JointType::kFloating:
      return reduce_floating(axis, tau.data() + k, diagonal, c, has_parent, scratch.IA[i],
                             scratch.pA[i], scratch.multi[i]);
  }
  return false;
}

}  // namespace

bool aba(const Model& model, const VectorRef& tau, const VectorRef& diagonal,
         const Vector3& gravity, BodyRange range, const BodyState& bodies, VectorOut a,
         int* singular_body) {
  const auto& [at, velocity, external, scratch] = bodies;
  for (int i = range.begin; i < range.end; ++i) {
    scratch.IA[i] = ArticulatedInertia::rigid(at.inertia[i]);
    if (!velocity.has_coriolis) {
      scratch.pA[i] = Force();
    } else if (velocity.has_mean_force[i]) {
      scratch.pA[i] = velocity.mean_force[i];
    } else {
      scratch.pA[i] = cross(at.V[i], at.inertia[i] * at.V[i]);
    }
    if (external.has_external) scratch.pA[i] -= external.external[i];
  }
  subtract_carried_weight(model, gravity, range, at, scratch.pA);
  for (const AddedInertia& more : external.added)
    if (more.body >= range.begin && more.body < range.end)
      scratch.IA[more.body] += ArticulatedInertia::rigid(more.inertia);
  for (int i = range.end - 1; i >= range.begin; --i) {
    if (!reduce_joint(model, i, tau, diagonal, bodies)) {
      if (singular_body != nullptr) *singular_body = i;
      return false;
    }
    const int parent = model.body(i).parent;
    if (parent == 0) continue;
    scratch.IA[parent].add_shifted(scratch.IA[i], at.arm[i]);
    scratch.pA[parent] += shift(scratch.pA[i], at.arm[i]);
  }
  const Motion of_world{Vector3::Zero(), -gravity};
  for (int i = range.begin; i < range.end; ++i) {
    const Body& body = model.body(i);
    double* a_i = a.data() + body.v_index;
    const Motion& of_parent = body.parent == 0 ? of_world : scratch.A[body.parent];
    const Motion A = shift(of_parent, at.arm[i]) + velocity_product(at, velocity, i);
    switch (body.joint_type) {
      case JointType::kRevolute:
      case JointType::kPrismatic:
        a_i[0] = scratch.D_inv[i] * (scratch.u[i] - dot(A, scratch.U[i]));
        break;
      case JointType::kPlanar:
      case JointType::kSpherical:
        accelerate_three(scratch.multi[i], A, a_i);
        break;
      case JointType::kFloating:
        accelerate_floating(&at.axis[body.v_index], scratch.multi[i], A, a_i);
        break;
    }
    scratch.A[i] = A + joint_motion(body.joint_type, &at.axis[body.v_index], a_i);
  }
  return true;
}

}  // namespace counterpoint
