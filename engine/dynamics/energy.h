// Mass, energy and momentum.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Total mass of all bodies that can move [kg].
double total_mass(const Model& model);

/// Kinetic energy [J], rotor inertia (armature) included. Requires compute_poses,
/// compute_velocities and compute_inertias.
double kinetic_energy(const Model& model, const VectorRef& v, const Kinematics& data);

/// Potential energy [J] of the weight that gravity compensation leaves; zero for a centre of mass
/// in the plane through the world origin normal to gravity. Requires compute_poses.
double potential_energy(const Model& model, const Kinematics& data);

/// Total momentum in W: force = linear [kg m/s], torque = angular about the world origin [kg
/// m^2/s], without rotor inertia. Requires compute_poses, compute_velocities and compute_inertias.
Force total_momentum(const Model& model, const Kinematics& data);

}  // namespace counterpoint
