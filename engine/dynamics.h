// Dynamics of a model without contacts and steps: poses and motion of its frames, inverse and
// forward dynamics, mass matrix, energy, momentum, and derivatives.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

// ---- Motion on the configuration manifold.

/// Computes q_next = q (+) h v: translations along v, rotations by the exponential map, quaternions
/// normalized. q, q_next: nq (may be the same memory); v: nv [m/s, rad/s]; h [s].
void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v, double h,
                             BodyRange bodies, VectorOut q_next);
inline void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v,
                                    double h, VectorOut q_next) {
  integrate_configuration(model, q, v, h, moving_bodies(model), q_next);
}

/// Computes v (nv) such that q_to = q_from (+) v, with rotation angles in [0, pi]; q_from, q_to:
/// nq.
void configuration_difference(const Model& model, const VectorRef& q_from, const VectorRef& q_to,
                              VectorOut v);

// ---- Inertial parameters of a body, in which inverse dynamics is linear (inertia_regressor.h).

/// The ten inertial parameters of a body, in its frame and about its origin: mass m [kg], first
/// moments m c (x, y, z) [kg m], second moments Ixx, Ixy, Iyy, Ixz, Iyz, Izz of the inertia tensor
/// about the origin [kg m^2].
using InertialParameters = Eigen::Matrix<double, 10, 1>;

/// Returns the parameters of a body with this inertia.
InertialParameters inertial_parameters(const SpatialInertia& inertia);
/// Returns the inertia tensor about the body's origin [kg m^2], body frame.
Matrix3 inertia_tensor(const InertialParameters& parameters);
/// Converts back to a spatial inertia. @throws InputError unless the mass is positive.
SpatialInertia spatial_inertia(const InertialParameters& parameters);

/// Returns the parameters of all bodies but the world, one after the other: 10 (num_bodies - 1).
VectorX inertial_parameters(const Model& model);

// ---- Effort limits of motors: the applied force of a joint is clamped to +-E in each coordinate.
//
// This applies to actuated joints without a servo; the constraint row of a servo includes the limit
// (servos.h). The inverse recovers the clamped force.

/// Clamps the applied forces `tau` (nv) [N, N m]. `effects` says whether servos are on.
void limit_applied_forces(const Model& model, EffectSet effects, VectorOut tau);

// ---- Implicit springs in joints: the force at the coordinate at the end of the step.
//
//   f = -k (q + h w+ - q_ref)
//
// Stable at any stiffness. Forward, with w+ = w + h a: k (q + h w - q_ref) is known, h^2 k is added
// to the diagonal of M. The inverse knows w+, hence f. For a single spring implicit Euler
// dissipates energy in every step and never adds any.

/// Adds the contribution of the springs to M to `diagonal` [kg, kg m^2], and their force at the
/// start of the step to `tau` [N, N m]; both nv. h [s].
void add_springs(const Model& model, double h, const VectorRef& q, const VectorRef& w,
                 VectorOut diagonal, VectorOut tau);

/// Adds the spring force in a step that ends with w_next to tau (nv) [N, N m].
void add_springs_inverse(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                         VectorOut tau);

/// Potential energy of the springs [J]. z: internal states (nz), which say which closures act;
/// empty: the model's.
double spring_energy(const Model& model, const VectorRef& q, const VectorRef& z = VectorX());

// ---- Derivatives of inverse dynamics (RNEA) and forward dynamics (ABA).

/// Derivatives of tau = M(q) a - n(q, v), nv x nv each: by a displacement of q, by v, by a.
struct RneaDerivatives {
  MatrixX dq;  ///< [N or N m per m or rad]
  MatrixX dv;  ///< [N or N m per m/s or rad/s]
  MatrixX da;  ///< M(q), symmetric [kg, kg m, kg m^2]
};

/// Derivatives of a = inv(M(q) + D) (n(q, v) + tau), nv x nv each: by a displacement of q, by v, by
/// tau.
struct AbaDerivatives {
  /// Derivatives by q and v [m/s^2 or rad/s^2 per m or rad, per m/s or rad/s].
  MatrixX dq, dv;
  MatrixX dtau;  ///< inv(M + D), symmetric
};

/// Pose and velocity of a frame F (a link as defined in its file, a named body of a scene) in the
/// world W.
struct FrameMotion {
  Pose X_WF;                 ///< position of the frame's origin [m], and its orientation
  Vector3 velocity;          ///< velocity of the frame's origin, in axes of W [m/s]
  Vector3 angular_velocity;  ///< in axes of W [rad/s]
};

/// Returns the motion of the named frame at a state; links merged into others by fixed joints have
/// frames too. Allocates; in inner loops use Dynamics::frame. @throws InputError as frame_index,
/// and if a size is not the model's.
FrameMotion frame_motion(const Model& model, const State& state, const std::string& name);

/// Returns the motions of all Model::frames(), in their order. Allocates.
std::vector<FrameMotion> frame_motions(const Model& model, const State& state);

/// Returns the index into Model::frames(). @throws InputError if the model has no frame of this
/// name; the message suggests the most similar name.
int frame_index(const Model& model, const std::string& name);

/// A model at a state. Each result is computed when it is asked for, once for each state. Nothing
/// is allocated after the first call of each kind, except for errors and where stated. Use one
/// object per thread.
///
/// Gravity is the model's. Forces and inertias of single coordinates (rotor inertia, damping, dry
/// friction, springs, servos) are not part of inverse dynamics and the mass matrix.
class Dynamics {
 public:
  /// Starts in the model's default configuration, at rest. The model must outlive this object.
  explicit Dynamics(const Model& model);
  explicit Dynamics(Model&&) = delete;  ///< a temporary would not outlive it
  ~Dynamics();
  Dynamics(Dynamics&&) noexcept;
  Dynamics& operator=(Dynamics&&) noexcept;

  const Model& model() const;

  /// Sets q (nq), with quaternions of unit length, and v (nv) [m/s, rad/s]. @throws InputError if a
  /// size is not the model's.
  void set_state(const VectorRef& q, const VectorRef& v);
  /// Sets q (nq) and v = 0.
  void set_configuration(const VectorRef& q);

  // Poses and motions. The index of a frame is that into Model::frames(), see Model::find_frame.

  FrameMotion frame(int index) const;
  /// @throws InputError as frame_index.
  FrameMotion frame(const std::string& name) const;
  /// Returns the pose X_WF alone.
  Pose frame_pose(int index) const;
  /// Computes the Jacobian J of a frame, resized to 6 x nv: J v is the angular velocity [rad/s]
  /// followed by the velocity of the frame's origin [m/s], in axes of W; J' maps torque and force
  /// at the origin to generalized forces.
  void frame_jacobian(int index, MatrixX& jacobian) const;
  /// Returns X_WG of a geometry, by its index into Model::geometries().
  Pose geometry_pose(int index) const;
  /// Returns how far the closure of this index in Model::closures() is open, as if it were
  /// attached; how far its anchor frames are apart, if it holds in place.
  ClosureGap closure_opening(int index) const;
  /// Returns the length of the tendon of this index in Model::tendons() [m, or rad].
  double tendon_length(int index) const;
  /// Computes its moment arms dL/dq into `arms` (nv) [m/rad, -]: its speed is arms . v, and a force
  /// F along it acts as F arms.
  void tendon_arms(int index, VectorOut arms) const;

  // Mass, energy and momentum.

  double total_mass() const;       ///< mass of all bodies that can move [kg]
  Vector3 center_of_mass() const;  ///< their centre of mass, in W [m]; NaN if there are none
  double kinetic_energy() const;   ///< [J], rotor inertia (armature) included
  /// Potential energy [J] of the weight that gravity compensation leaves; zero for a centre of mass
  /// in the plane through the world origin normal to gravity. Springs are not included: see
  /// spring_energy.
  double potential_energy() const;
  /// Total momentum: linear [kg m/s], angular about the world origin [kg m^2/s], in W; without
  /// rotor inertia.
  Force momentum() const;

  // Equations of motion M(q) a = n(q, v) + tau.

  /// Computes tau (nv) [N, N m] for the acceleration a (nv) [m/s^2, rad/s^2] by the recursive
  /// Newton-Euler algorithm (Featherstone 2008, table 5.1).
  void inverse_dynamics(const VectorRef& a, VectorOut tau);
  /// Solves (M(q) + diag(diagonal)) a = n(q, v) + tau by the articulated-body algorithm (table
  /// 7.1). diagonal (nv): inertia of single coordinates, such as Model::armature(). Returns false,
  /// and the body in `singular_body` if given, if the inertia that a joint moves is not positive.
  bool forward_dynamics(const VectorRef& tau, const VectorRef& diagonal, VectorOut a,
                        int* singular_body = nullptr);
  /// Computes M(q), nv x nv, both triangles, block diagonal by tree [kg, kg m, kg m^2], by the
  /// composite-rigid-body algorithm (table 6.2).
  void mass_matrix(Eigen::Ref<MatrixX> M);

  // Derivatives; a displacement dq of a configuration means q (+) dq (integrate_configuration).

  /// Computes the derivatives of tau(q, v, a).
  void inverse_dynamics_derivatives(const VectorRef& a, RneaDerivatives& out);
  /// Computes the derivatives of a(q, v, tau). Returns false where forward_dynamics does.
  bool forward_dynamics_derivatives(const VectorRef& tau, const VectorRef& diagonal,
                                    AbaDerivatives& out, int* singular_body = nullptr);
  /// Computes Y, nv x 10 (num_bodies - 1), with tau = Y inertial_parameters(model), without gravity
  /// compensation (Atkeson, An, Hollerbach 1986).
  void inertia_regressor(const VectorRef& a, MatrixX& Y);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint
