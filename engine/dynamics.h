// Dynamics of a model by itself, without contacts and steps: where its frames are and how they
// move, inverse and forward dynamics, the mass matrix, energy and momentum, and the derivatives of
// these.
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

/// q_next = q (+) h v: translations along v, rotations by the exponential map, quaternions kept at
/// unit length. q, q_next: nq (may be the same memory); v: nv.
void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v, double h,
                             BodyRange bodies, VectorOut q_next);
inline void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v,
                                    double h, VectorOut q_next) {
  integrate_configuration(model, q, v, h, moving_bodies(model), q_next);
}

/// v (nv) such that q_to = q_from (+) v: the inverse, rotation angles in [0, pi].
void configuration_difference(const Model& model, const VectorRef& q_from, const VectorRef& q_to,
                              VectorOut v);

// ---- The figures of a body that inverse dynamics is linear in (inertia_regressor.h).

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

// ---- What motors can give: the applied force of a joint is clamped to +-E in each coordinate.
//
// Of actuated joints without a servo; the row of a servo includes the limit (servos.h). The inverse
// recovers the clamped force.

/// Clamps the applied forces `tau` (nv) [N, N m]. `effects` says whether servos are on.
void limit_applied_forces(const Model& model, EffectSet effects, VectorOut tau);

// ---- Springs in joints, implicit: the force at the coordinate with which the step ends.
//
//   f = -k (q + h w+ - q_ref)
//
// Stable at any stiffness. Forward, with w+ = w + h a: k (q + h w - q_ref) is known, h^2 k stands
// on the diagonal of M. Inverse: w+ is known, so f is. Of a lone spring implicit Euler takes energy
// in every step, never gives any.

/// What the springs add to M, onto `diagonal` [kg, kg m^2], and to the force at the start of the
/// step, onto `tau` [N, N m]; both nv. h [s].
void add_springs(const Model& model, double h, const VectorRef& q, const VectorRef& w,
                 VectorOut diagonal, VectorOut tau);

/// The force that the springs took up in a step that ends with w_next, onto tau (nv) [N, N m].
void add_springs_inverse(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                         VectorOut tau);

/// Energy in the springs [J].
double spring_energy(const Model& model, const VectorRef& q);

// ---- Derivatives of inverse dynamics (RNEA) and forward dynamics (ABA): what is computed of them.

/// Of tau = M(q) a - n(q, v), nv x nv each: by a displacement at q, by v, by a.
struct RneaDerivatives {
  MatrixX dq;  ///< [N, N m a m, rad]
  MatrixX dv;  ///< [N s/m, ...]
  MatrixX da;  ///< M(q), symmetric [kg, kg m, kg m^2]
};

/// Of a = inv(M(q) + D) (n(q, v) + tau), nv x nv each: by a displacement at q, by v, by tau.
struct AbaDerivatives {
  MatrixX dq, dv;
  MatrixX dtau;  ///< inv(M + D), symmetric
};

/// Pose and velocity of a frame F (a link as its file has it, a named body of a scene) in the world
/// W.
struct FrameMotion {
  Pose X_WF;                 ///< where the frame's origin is [m], and its orientation
  Vector3 velocity;          ///< of the frame's origin, axes of W [m/s]
  Vector3 angular_velocity;  ///< axes of W [rad/s]
};

/// Of the named frame at a state; links merged into others by fixed joints have theirs too.
/// Allocates: for inner loops Dynamics::frame. @throws InputError as frame_index, and where sizes
/// are not the model's.
FrameMotion frame_motion(const Model& model, const State& state, const std::string& name);

/// Of all Model::frames(), in their order.
std::vector<FrameMotion> frame_motions(const Model& model, const State& state);

/// Index into Model::frames(). @throws InputError if the model has no frame of this name, naming
/// one that is nearly called so.
int frame_index(const Model& model, const std::string& name);

/// A model at a state. What is asked of it is computed then, once for each state; nothing is
/// allocated after the first call of each kind, but for errors and where said. For one thread.
///
/// Gravity is the model's. What acts on single coordinates beside the bodies' inertia (rotor
/// inertia, damping, dry friction, springs, servos) is not part of inverse dynamics and the mass
/// matrix.
class Dynamics {
 public:
  /// At the model's default configuration, at rest. The model must outlive this.
  explicit Dynamics(const Model& model);
  explicit Dynamics(Model&&) = delete;  ///< which would not
  ~Dynamics();
  Dynamics(Dynamics&&) noexcept;
  Dynamics& operator=(Dynamics&&) noexcept;

  const Model& model() const;

  /// q (nq): quaternions must be of unit length; v (nv) [m/s, rad/s]. @throws InputError where
  /// sizes are not the model's.
  void set_state(const VectorRef& q, const VectorRef& v);
  /// At rest.
  void set_configuration(const VectorRef& q);

  // Where things are. A frame's index is that into Model::frames(), as Model::find_frame gives it.

  FrameMotion frame(int index) const;
  /// @throws InputError as frame_index.
  FrameMotion frame(const std::string& name) const;
  /// X_WF alone.
  Pose frame_pose(int index) const;
  /// J of a frame into (6 x nv, given its size): angular velocity [rad/s], then velocity of the
  /// frame's origin [m/s], axes of W, are J v. J' times torque and force at the origin is their
  /// generalized force.
  void frame_jacobian(int index, MatrixX& jacobian) const;
  /// X_WG of a geometry, by its index into Model::geometries().
  Pose geometry_pose(int index) const;
  /// How far a closure of Model::closures() is open.
  ClosureGap closure_opening(int index) const;

  // Mass, energy and momentum.

  double total_mass() const;       ///< of all bodies that can move [kg]
  Vector3 center_of_mass() const;  ///< of these, in W [m]; NaN where there are none
  double kinetic_energy() const;   ///< [J], rotor inertia (armature) included
  /// [J], zero where a body's centre of mass is in the plane through the world's origin across
  /// gravity; of what is left of the weight where some is carried. Springs by themselves:
  /// spring_energy.
  double potential_energy() const;
  /// Of all bodies: linear [kg m/s], angular about the world's origin [kg m^2/s]. Without rotor
  /// inertia.
  Force momentum() const;

  // Equations of motion M(q) a = n(q, v) + tau.

  /// tau (nv) [N, N m] that gives acceleration a (nv) [m/s^2, rad/s^2], by the recursive
  /// Newton-Euler algorithm (Featherstone 2008, table 5.1).
  void inverse_dynamics(const VectorRef& a, VectorOut tau);
  /// a of (M(q) + diag(diagonal)) a = n(q, v) + tau, by the articulated-body algorithm (table 7.1).
  /// diagonal (nv): what acts on single coordinates, Model::armature() say. False, with the body in
  /// `singular_body` if given, where the inertia that a joint moves is not positive.
  bool forward_dynamics(const VectorRef& tau, const VectorRef& diagonal, VectorOut a,
                        int* singular_body = nullptr);
  /// M(q), nv x nv, both triangles, block diagonal by tree [kg, kg m, kg m^2], by the
  /// composite-rigid-body algorithm (table 6.2).
  void mass_matrix(Eigen::Ref<MatrixX> M);

  // Derivatives; a displacement dq of a configuration means q (+) dq (integrate_configuration).

  /// Of tau(q, v, a).
  void inverse_dynamics_derivatives(const VectorRef& a, RneaDerivatives& out);
  /// Of a(q, v, tau). False, as forward_dynamics, where it is singular.
  bool forward_dynamics_derivatives(const VectorRef& tau, const VectorRef& diagonal,
                                    AbaDerivatives& out, int* singular_body = nullptr);
  /// Y, nv x 10 (num_bodies - 1): tau = Y inertial_parameters(model), weight that is carried left
  /// out (Atkeson, An, Hollerbach 1986).
  void inertia_regressor(const VectorRef& a, MatrixX& Y);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint
