// Mass, energy and momentum.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Of all bodies that can move [kg].
double total_mass(const Model& model);

/// [J], rotor inertia (armature) included. Needs compute_poses, compute_velocities and
/// compute_inertias.
double kinetic_energy(const Model& model, const VectorRef& v, const Kinematics& data);

/// [J], zero where a body's centre of mass is in the plane through the world origin across gravity;
/// of what is left of the weight where some is carried. Needs compute_poses.
double potential_energy(const Model& model, const Kinematics& data);

/// Total momentum in W: force = linear [kg m/s], torque = angular about the world origin [kg
/// m^2/s]. Rotor inertia is not part of it. Needs compute_poses, compute_velocities and
/// compute_inertias.
Force total_momentum(const Model& model, const Kinematics& data);

}  // namespace counterpoint
