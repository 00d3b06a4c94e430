#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/model.h"

namespace counterpoint {
namespace {

constexpr double kMomentTolerance = 1e-6;     // relative to the largest principal moment
constexpr double kDiagonalTolerance = 1e-14;  // round-off of sums in one common frame, relative
constexpr double kPivotTolerance = 1e-12;     // round-off of the elimination with a safety factor

constexpr double kEigenvalueTolerance = 1e-15;  // round-off of a sum, per coordinate
// A coordinate takes part in a motion if its component is at least this fraction of the largest.
constexpr double kTakesPart = 1e-2;
// Most coordinates for the eigenvalue test: it takes 0.1 s there, and longer chains come near its
// tolerance legitimately.
constexpr Eigen::Index kMostForEigenvalues = 300;

// Least repaired moment over the largest one: the value of a rod 25 times as long as wide.
constexpr double kLeastMomentRatio = 1e-3;

using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;

/// Returns the joint's motion subspace S (Featherstone 2008): column k is the spatial velocity
/// (angular, linear) of the body per unit of velocity coordinate k, in the body frame. Linear
/// velocity coordinates of planar and floating joints are along the axes of J.
Matrix6X motion_subspace(JointType type, const Matrix3& R_JB) {
  Matrix6X s = Matrix6X::Zero(6, joint_nv(type));
  switch (type) {
    case JointType::kRevolute:
      s(2, 0) = 1.0;
      break;
    case JointType::kPrismatic:
      s(5, 0) = 1.0;
      break;
    case JointType::kPlanar:
      s.block<3, 2>(3, 0) = R_JB.transpose().leftCols<2>();
      s(2, 2) = 1.0;
      break;
    case JointType::kSpherical:
      s.topRows<3>().setIdentity();
      break;
    case JointType::kFloating:
      s.block<3, 3>(3, 0) = R_JB.transpose();
      s.block<3, 3>(0, 3).setIdentity();
      break;
  }
  return s;
}

/// Detects a motion without inertia where elimination cannot: it magnifies round-off where joint
/// axes nearly coincide, but the least eigenvalue of M scaled to a unit diagonal does not. Returns
/// the coordinate nearest to the root that takes part in that motion, or -1 if there is none.
int find_idle_motion(const MatrixX& mass) {
  const auto n = static_cast<double>(mass.rows());
  if (mass.rows() == 0 || mass.rows() > kMostForEigenvalues) return -1;
  const VectorX root = mass.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixX> eigen(root.asDiagonal() * mass * root.asDiagonal());
  if (eigen.eigenvalues()[0] > kEigenvalueTolerance * n) return -1;
  const VectorX share = eigen.eigenvectors().col(0).cwiseAbs();
  int k = 0;
  while (share[k] < kTakesPart * share.maxCoeff()) ++k;
  return k;
}

}  // namespace

std::string inertia_defect(const SpatialInertia& inertia) {
  if (inertia.rotational.isZero(0.0)) return "";
  const Vector3 m =
      Eigen::SelfAdjointEigenSolver<Matrix3>(inertia.rotational, Eigen::EigenvaluesOnly)
          .eigenvalues();  // in increasing order
  if (inertia.mass == 0.0) {
    return fmt::format("principal moments of inertia ({:.6g}, {:.6g}, {:.6g}) kg m^2 without mass",
                       m[0], m[1], m[2]);
  }
  const double tolerance = kMomentTolerance * std::max(m[2], -m[0]);
  if (m[0] <= 0.0) {
    return fmt::format(
        "principal moments of inertia ({:.6g}, {:.6g}, {:.6g}) kg m^2 are not all positive", m[0],
        m[1], m[2]);
  }
  if (m[0] + m[1] < m[2] - tolerance) {
    return fmt::format(
        "principal moments of inertia ({:.6g}, {:.6g}, {:.6g}) kg m^2 violate the triangle "
        "inequality",
        m[0], m[1], m[2]);
  }
  return "";
}

PrincipalAxes principal_axes(const Matrix3& inertia) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(inertia);
  PrincipalAxes principal{eigen.eigenvalues(), eigen.eigenvectors()};
  if (principal.axes.determinant() < 0.0) principal.axes.col(0) *= -1.0;
  return principal;
}

SpatialInertia nearest_physical(const SpatialInertia& inertia) {
  const auto& [moments, axes] = principal_axes(inertia.rotational);
  Vector3 m = moments;
  m = m.cwiseMax(kLeastMomentRatio * std::max(m[2], 0.0));
  // Projection onto the half-space m0 + m1 >= m2 moves all three moments by the same amount.
  const double excess = m[2] - m[0] - m[1];
  if (excess > 0.0) m += Vector3(excess, excess, -excess) / 3.0;
  SpatialInertia repaired = inertia;
  repaired.rotational = axes * m.asDiagonal() * axes.transpose();
  return repaired;
}

SpatialInertia solid_inertia(const Shape& shape, double mass) {
  const double r = shape.size[0];
  const double half = shape.size[1];
  Vector3 moments = Vector3::Zero();
  switch (shape.type) {
    case ShapeType::kSphere:
      moments.setConstant(0.4 * r * r);
      break;
    case ShapeType::kBox: {
      const Vector3 s2 = shape.size.cwiseAbs2();
      moments = (Vector3::Constant(s2.sum()) - s2) / 3.0;
      break;
    }
    case ShapeType::kCylinder: {
      const double across = r * r / 4.0 + half * half / 3.0;
      moments << across, across, r * r / 2.0;
      break;
    }
    case ShapeType::kCapsule: {
      // A cylinder and two half spheres whose centres of mass lie 3/8 r beyond the cylinder's ends.
      const double ball = 2.0 * r / (2.0 * r + 3.0 * half);  // mass fraction of the two caps
      const double far = half + 0.375 * r;
      const double cap = 0.4 * r * r - std::pow(0.375 * r, 2) + far * far;
      const double across = (1.0 - ball) * (r * r / 4.0 + half * half / 3.0) + ball * cap;
      moments << across, across, (1.0 - ball) * r * r / 2.0 + ball * 0.4 * r * r;
      break;
    }
    case ShapeType::kPlane:
    case ShapeType::kConvexMesh:
    case ShapeType::kTerrain:
      throw std::logic_error("solid_inertia: not for this shape");
  }
  return {mass, Vector3::Zero(), mass * Matrix3(moments.asDiagonal())};
}

double solid_volume(const Shape& shape) {
  const Vector3& s = shape.size;
  const double ball = 4.0 / 3.0 * EIGEN_PI * s[0] * s[0] * s[0];
  const double straight = 2.0 * EIGEN_PI * s[0] * s[0] * s[1];
  switch (shape.type) {
    case ShapeType::kSphere:
      return ball;
    case ShapeType::kBox:
      return 8.0 * s.prod();
    case ShapeType::kCylinder:
      return straight;
    case ShapeType::kCapsule:
      return straight + ball;
    case ShapeType::kPlane:
    case ShapeType::kConvexMesh:
    case ShapeType::kTerrain:
      break;
  }
  throw std::logic_error("solid_volume: not for this shape");
}

MatrixX reference_mass_matrix(const Model& model, int tree, const VectorX& q, VectorX* scale) {
  const Tree& t = model.trees()[tree];
  const int bodies = t.body_end - t.body_begin;
  // All quantities are expressed at the origin and in the axes of the tree's first body.
  std::vector<Pose> X_RB(bodies);
  std::vector<Matrix6> composite(bodies);
  std::vector<Matrix6X> subspace(bodies);
  for (int i = 0; i < bodies; ++i) {
    const Body& body = model.body(t.body_begin + i);
    const Pose X_JB = joint_pose(Pose(), body.joint_type, q.data() + body.q_index);
    if (i > 0) X_RB[i] = X_RB[body.parent - t.body_begin] * body.X_PJ * X_JB;
    composite[i] = body.inertia.transformed(X_RB[i]).matrix();
    subspace[i] = motion_subspace(body.joint_type, X_JB.rotation);
    for (int k = 0; k < subspace[i].cols(); ++k) {
      const Motion s = X_RB[i] * Motion{subspace[i].col(k).head<3>(), subspace[i].col(k).tail<3>()};
      subspace[i].col(k) << s.angular, s.linear;
    }
  }
  for (int i = bodies - 1; i > 0; --i) {
    composite[model.body(t.body_begin + i).parent - t.body_begin] += composite[i];
  }
  const int nv = t.v_end - t.v_begin;
  MatrixX mass = MatrixX::Zero(nv, nv);
  if (scale != nullptr) scale->setZero(nv);
  for (int i = 0; i < bodies; ++i) {
    const int vi = model.body(t.body_begin + i).v_index - t.v_begin;
    const int ni = static_cast<int>(subspace[i].cols());
    const Matrix6X momentum = composite[i] * subspace[i];
    if (scale != nullptr) {
      const double rotational = composite[i].diagonal().head<3>().cwiseAbs().maxCoeff();
      const double mass_scale = std::abs(composite[i](5, 5));
      scale->segment(vi, ni) =
          rotational * subspace[i].topRows<3>().colwise().squaredNorm().transpose() +
          mass_scale * subspace[i].bottomRows<3>().colwise().squaredNorm().transpose();
    }
    for (int j = i; j >= 0; j = model.body(t.body_begin + j).parent - t.body_begin) {
      const int vj = model.body(t.body_begin + j).v_index - t.v_begin;
      const int nj = static_cast<int>(subspace[j].cols());
      mass.block(vj, vi, nj, ni) = subspace[j].transpose() * momentum;
      if (j != i) mass.block(vi, vj, ni, nj) = mass.block(vj, vi, nj, ni).transpose();
    }
  }
  mass.diagonal() += model.armature().segment(t.v_begin, nv);
  return mass;
}

int find_coordinate_without_inertia(const Model& model, int tree, const VectorX& q) {
  VectorX scale;
  MatrixX mass = reference_mass_matrix(model, tree, q, &scale);
  const VectorX diagonal = mass.diagonal();
  for (int k = static_cast<int>(diagonal.size()) - 1; k >= 0; --k) {
    const double pivot = mass(k, k);
    // Negated comparisons also reject NaN.
    if (!(diagonal[k] > kDiagonalTolerance * scale[k])) return k;
    if (!(pivot > kPivotTolerance * diagonal[k])) return k;
    // The smallest pivot that can be inverted safely is kMinMass at a lever arm of kMinLength.
    if (!(pivot >= limits::kMinMass * limits::kMinLength * limits::kMinLength)) return k;
    const VectorX column = mass.col(k).head(k);
    mass.topLeftCorner(k, k) -= column * column.transpose() / pivot;
  }
  return find_idle_motion(reference_mass_matrix(model, tree, q));
}

}  // namespace counterpoint
