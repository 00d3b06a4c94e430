// Terms about where bodies and points are, with their derivatives by the configurations.
#pragma once

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/optimize/problem.h"

namespace counterpoint::optimization {

/// Position [m] in W of a point of a body.
Vector3 point_position(const Data& data, int body, const Vector3& point);
/// 3 x nv: the derivative of that. Needs compute_poses.
void point_jacobian(const Model& model, const Data& data, int body, const Vector3& position,
                    Eigen::Ref<MatrixX> out);

/// Scratch of one thread.
struct KinematicScratch {
  explicit KinematicScratch(const Model& model);
  MatrixX a, b;                 ///< 3 x nv
  std::vector<Vector3> moment;  ///< by body
  std::vector<double> mass;
};

/// The value of a term of a frame that is no row of coordinates (rows), from the poses of the frame
/// before and its own, h [s] apart; and, unless null, its derivatives (rows x nv each) by both in
/// their tangent spaces. Not kAngularMomentum.
void evaluate_kinematic(const Model& model, const Term& term, double h, const Data& before,
                        const Data& at, KinematicScratch& scratch, VectorOut value,
                        MatrixX* by_before, MatrixX* by_at);  // Parameters: what it depends on, one by one

/// Angular momentum [kg m^2/s] about the centre of mass of all that moves at the velocities in
/// data.V. Needs compute_velocities.
Vector3 angular_momentum(const Model& model, const Data& data);

}  // namespace counterpoint::optimization
