// Per-body results of the recursive algorithms. Recomputable; fields grouped by what fills them.
//
// Every body's motions and forces are kept in world axes at the body's own origin: going from body
// to parent then takes a shift and no rotation, and lengths in the arithmetic stay those of a link,
// however far from the world's origin it is (docs/decisions/dynamics.md).
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/articulated_inertia.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// The joint's share of an articulated-body sweep, for joints of more than one coordinate.
struct MultiDofFactor {
  Eigen::Matrix<double, 6, 6> U;      ///< IA S, first nv columns; floating: IA
  Eigen::Matrix<double, 6, 6> D_inv;  ///< of S' IA S + diagonal; floating: Cholesky factor, in W
  Vector6 u;                          ///< tau - S' pA; floating: S tau - pA
};

/// Inertia that only the forward step has, seen from the body's origin, in axes of W.
struct AddedInertia {
  int body = 0;
  SpatialInertia inertia;
};

struct Data {
  explicit Data(const Model& model);

  // compute_poses (kinematics.h)
  std::vector<double> sine, cosine;  ///< by body, of a revolute joint's angle
  /// Of the bodies that the algorithms use, which are turned so that a joint's axis is z: for the
  /// pose of a link as its file has it, Dynamics::frame (engine/dynamics.h).
  std::vector<Pose> X_WB;
  std::vector<Vector3> arm;  ///< from the parent's origin to the body's, in W [m]
  std::vector<Motion> axis;  ///< nv: columns of the joints' motion subspaces S, in W

  // compute_velocities
  std::vector<Motion> V;  ///< V_WB
  std::vector<Motion> c;  ///< velocity product: dS/dt v + V x S v

  // compute_inertias
  std::vector<SpatialInertia> inertia;

  // aba, crba: beyond data.inertia, and not in forces quadratic in velocity; set by the caller
  std::vector<AddedInertia> added;

  // rnea, aba: external wrenches, set by the caller
  std::vector<Force> external;
  bool has_external = false;

  // rnea, aba: forces quadratic in velocity; where they are left out, c is to be zero as well
  bool has_coriolis = true;

  // rnea, aba: the mean over the step of V x* I V, at the body's origin in W [N m, N], for bodies
  // where the caller knows it (free_flight.h, energy_projection.h); their c is then to be zero
  std::vector<char> has_mean_force;
  std::vector<Force> mean_force;
  VectorX mean_rotor_force;  ///< nv: of their rotors, for the caller to add [N m, N]

  // rnea
  std::vector<Motion> A;  ///< spatial acceleration less gravity
  std::vector<Force> F;   ///< force through the joint

  // aba
  std::vector<ArticulatedInertia> IA;
  std::vector<Force> pA;
  std::vector<Force> U;  ///< joints of one coordinate: IA S
  std::vector<double> D_inv, u;
  std::vector<MultiDofFactor> multi;  ///< by body; used where joint_nv > 1

  // crba
  std::vector<RigidInertia> composite;  ///< of the subtrees, about their first bodies' origins
};

}  // namespace counterpoint
