// The figures of a body that inverse dynamics is linear in (inertia_regressor.h).
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

/// The ten inertial parameters of a body, in its frame and about its origin: mass m [kg], first
/// moments m c (x, y, z) [kg m], second moments Ixx, Ixy, Iyy, Ixz, Iyz, Izz of the inertia tensor
/// about the origin [kg m^2].
using InertialParameters = Eigen::Matrix<double, 10, 1>;

InertialParameters inertial_parameters(const SpatialInertia& inertia);
/// Of these the inertia tensor about the body's origin [kg m^2].
Matrix3 inertia_tensor(const InertialParameters& parameters);
/// The reverse. @throws InputError unless the mass is positive.
SpatialInertia spatial_inertia(const InertialParameters& parameters);

/// Of all bodies of a model but the world, one below the other: 10 (num_bodies - 1).
VectorX inertial_parameters(const Model& model);

}  // namespace counterpoint
