// Terms about where bodies and points are, with their derivatives by the configurations.
#pragma once

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Position [m] in W of a point of a body.
Vector3 point_position(const Kinematics& data, int body, const Vector3& point);
/// 3 x nv: the derivative of that. Needs compute_poses.
void point_jacobian(const Model& model, const Kinematics& data, int body, const Vector3& position,
                    Eigen::Ref<MatrixX> out);

/// 3 x nv: angular velocity of a body in W by v. Needs compute_poses.
void angular_jacobian(const Model& model, const Kinematics& data, int body, MatrixX& out);

/// Scratch of one thread.
struct KinematicScratch {
  explicit KinematicScratch(const Model& model);
  MatrixX a, b;                 ///< 3 x nv
  std::vector<Vector3> moment;  ///< by body
  std::vector<double> mass;
};

/// The poses of a frame and of the one before, h [s] apart.
struct FramePoses {
  const Model& model;
  double h;
  const Data &before, &at;
};

/// A term's value (rows) and, unless null, its derivatives (rows x nv each) by both frames in their
/// tangent spaces.
struct TermValue {
  VectorOut value;
  MatrixX *by_before = nullptr, *by_at = nullptr;

  bool derivatives() const { return by_at != nullptr; }
};

/// A term of a frame that is no row of coordinates. Not kAngularMomentum.
void evaluate_kinematic(const FramePoses& frames, const Term& term, KinematicScratch& scratch,
                        TermValue out);

/// Angular momentum [kg m^2/s] about the centre of mass of all that moves at the velocities in
/// data.V. Needs compute_velocities.
Vector3 angular_momentum(const Model& model, const Kinematics& data);

}  // namespace counterpoint::optimization
