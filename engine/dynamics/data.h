// Results of the recursive algorithms per body; all can be recomputed. Fields are grouped by the
// function that fills them.
//
// Motions and forces of a body are expressed in axes of W at the body's own origin. A
// transformation from body to parent is then a shift without rotation, and all lengths are those of
// links, however far the body is from the world origin (docs/decisions/dynamics.md).
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/articulated_inertia.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Factors of an articulated-body sweep for a joint of more than one coordinate.
struct MultiDofFactor {
  Eigen::Matrix<double, 6, 6> U;      ///< IA S, first nv columns; floating: IA
  Eigen::Matrix<double, 6, 6> D_inv;  ///< inverse of S' IA S + diagonal; floating: Cholesky factor
  Vector6 u;                          ///< tau - S' pA; floating: S tau - pA
};

/// Additional inertia used by the forward step only, relative to the body's origin, in axes of W.
struct AddedInertia {
  int body = 0;
  SpatialInertia inertia;
};

struct Data {
  explicit Data(const Model& model);

  // compute_poses (kinematics.h)
  std::vector<double> sine, cosine;  ///< sine and cosine of revolute joint angles, by body
  /// Poses of the bodies that the algorithms use; their frames are rotated so that the joint axis
  /// is z. For the pose of a link as defined in its file see Dynamics::frame (engine/dynamics.h).
  std::vector<Pose> X_WB;
  std::vector<Vector3> arm;  ///< from the parent's origin to the body's, in W [m]
  std::vector<Motion> axis;  ///< nv: columns of the joints' motion subspaces S, in W

  // compute_velocities
  std::vector<Motion> V;  ///< V_WB
  std::vector<Motion> c;  ///< velocity product: dS/dt v + V x S v

  // compute_inertias
  std::vector<SpatialInertia> inertia;

  // aba, crba: inertia in addition to data.inertia, without velocity-dependent forces; set by the
  // caller
  std::vector<AddedInertia> added;

  // rnea, aba: external wrenches, set by the caller
  std::vector<Force> external;
  bool has_external = false;

  // rnea, aba: whether velocity-dependent forces are included; if not, c must be zero
  bool has_coriolis = true;

  // rnea, aba: mean over the step of V x* I V at the body's origin in W [N m, N], for bodies for
  // which the caller knows it (free_flight.h, energy_projection.h); their c must then be zero
  std::vector<char> has_mean_force;
  std::vector<Force> mean_force;
  VectorX mean_rotor_force;  ///< nv: mean forces of their rotors, added by the caller [N m, N]

  // rnea
  std::vector<Motion> A;  ///< spatial acceleration minus gravity
  std::vector<Force> F;   ///< force transmitted by the joint

  // aba
  std::vector<ArticulatedInertia> IA;
  std::vector<Force> pA;
  std::vector<Force> U;  ///< IA S of joints of one coordinate
  std::vector<double> D_inv, u;
  std::vector<MultiDofFactor> multi;  ///< per body; used if joint_nv > 1

  // crba
  /// Inertias of the subtrees about the origins of their root bodies.
  std::vector<RigidInertia> composite;
};

}  // namespace counterpoint
