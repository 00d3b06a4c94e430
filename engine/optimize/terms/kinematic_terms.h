// Terms of positions and orientations of bodies, with derivatives with respect to configurations.
#pragma once

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Position [m] in W of a point of a body.
Vector3 point_position(const Kinematics& data, int body, const Vector3& point);
/// Jacobian (3 x nv) of that position with respect to v. Needs compute_poses.
void point_jacobian(const Model& model, const Kinematics& data, int body, const Vector3& position,
                    Eigen::Ref<MatrixX> out);

/// Adds the row of that Jacobian in a direction (unit vector in W) to out (nv).
void add_point_speed(const Model& model, const Kinematics& data, int body, const Vector3& position,
                     const Vector3& direction, VectorX& out);

/// Jacobian (3 x nv) of the angular velocity of a body in W with respect to v. Needs compute_poses.
void angular_jacobian(const Model& model, const Kinematics& data, int body, MatrixX& out);

/// Scratch memory of one thread.
struct KinematicScratch {
  explicit KinematicScratch(const Model& model);
  MatrixX a, b;                 ///< 3 x nv
  std::vector<Vector3> moment;  ///< one per body
  std::vector<double> mass;
};

/// The poses of a frame and of the frame before it, h [s] apart.
struct FramePoses {
  const Model& model;
  double h;
  const Data &before, &at;
  int frame = 0;  ///< for targets by frame
};

/// A term's value (rows) and, unless null, its derivatives (rows x nv each) with respect to both
/// frames in their tangent spaces.
struct TermValue {
  VectorOut value;
  MatrixX *by_before = nullptr, *by_at = nullptr;

  bool derivatives() const { return by_at != nullptr; }
};

/// Evaluates a term of a frame that has no rows by coordinate; not kAngularMomentum.
void evaluate_kinematic(const FramePoses& frames, const Term& term, KinematicScratch& scratch,
                        TermValue out);

/// Angular momentum [kg m^2/s] of all bodies about their centre of mass, at the velocities in
/// data.V. Needs compute_velocities.
Vector3 angular_momentum(const Model& model, const Kinematics& data);

}  // namespace counterpoint::optimization
