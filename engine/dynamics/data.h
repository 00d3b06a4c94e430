// Kinematics of the bodies, the forces on them, and the scratch memory of the recursive algorithms.
//
// Motions and forces of a body are expressed in world axes at the body's own origin. Going from a
// body to its parent then takes a shift and no rotation, and lengths in the arithmetic stay those
// of a link, however far from the world's origin it is (docs/decisions/dynamics.md).
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

/// Poses, velocities and inertias of all bodies at one (q, v): written by the functions of
/// kinematics.h alone, read by everything else.
struct Kinematics {
  explicit Kinematics(const Model& model);

  // compute_poses
  std::vector<double> sine, cosine;  ///< per body: of a revolute joint's angle
  /// Poses of the frames that the algorithms use, which are turned so that a joint's axis is z.
  /// Dynamics::frame (engine/dynamics.h) gives the pose of a link as its file has it.
  std::vector<Pose> X_WB;
  std::vector<Vector3> arm;  ///< from the parent's origin to the body's, in W [m]
  std::vector<Motion> axis;  ///< nv: columns of the joints' motion subspaces S, in W

  // compute_velocities
  std::vector<Motion> V;  ///< V_WB
  std::vector<Motion> c;  ///< velocity product: dS/dt v + V x S v

  // compute_inertias
  std::vector<SpatialInertia> inertia;
};

/// Velocity-dependent (Coriolis, centrifugal, gyroscopic) forces in the form that rnea and aba
/// take: none, or for each body those at (q, v), or their mean over the step.
struct VelocityForces {
  explicit VelocityForces(const Model& model);

  bool has_coriolis = true;
  /// Per body: whether mean_force replaces V x* I V and I c (free_flight.h, mid_velocity.h,
  /// energy_projection.h).
  std::vector<char> has_mean_force;
  std::vector<Force> mean_force;  ///< at the body's origin, in W [N m, N]
  VectorX mean_rotor_force;       ///< nv: of the rotors, for the caller to add [N m, N]

  /// Whether the force on a body is the one at (q, v).
  bool is_instantaneous(int body) const { return has_coriolis && !has_mean_force[body]; }
};

/// Wrenches on bodies, and inertia that only the forward step has.
struct ExternalForces {
  explicit ExternalForces(const Model& model) : external(model.num_bodies()) {}

  bool has_external = false;    ///< whether the wrenches are used
  std::vector<Force> external;  ///< per body: at its origin, in W [N m, N]
  std::vector<AddedInertia> added;

  /// Makes the wrenches zero, and uses them.
  void begin() {
    has_external = true;
    for (Force& f : external) f = Force();
  }
};

inline const Motion kNoMotion;

/// The velocity product that accelerations start from: c, or zero where the velocity-dependent
/// force is not the one at (q, v).
inline const Motion& velocity_product(const Kinematics& at, const VelocityForces& velocity,
                                      int body) {
  return velocity.is_instantaneous(body) ? at.c[body] : kNoMotion;
}

/// Scratch memory of the recursive algorithms: one per thread.
struct DynamicsScratch {
  explicit DynamicsScratch(const Model& model);

  // rnea, aba
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

/// All of them, for callers that own them together.
struct Data : Kinematics, VelocityForces, ExternalForces, DynamicsScratch {
  explicit Data(const Model& model)
      : Kinematics(model), VelocityForces(model), ExternalForces(model), DynamicsScratch(model) {}
};

/// The arguments of a recursive algorithm, which writes nothing but its scratch memory.
struct BodyState {
  BodyState(const Kinematics& kinematics, const VelocityForces& velocity_forces,
            const ExternalForces& external_forces, DynamicsScratch& scratch_memory)
      : at(kinematics),
        velocity(velocity_forces),
        external(external_forces),
        scratch(scratch_memory) {}
  BodyState(Data& data) : BodyState(data, data, data, data) {}  // NOLINT: implicit on purpose

  const Kinematics& at;
  const VelocityForces& velocity;
  const ExternalForces& external;
  DynamicsScratch& scratch;
};

}  // namespace counterpoint
