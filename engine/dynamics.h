// Dynamics of a model by itself, without contacts and steps: where its frames are and how they
// move, inverse and forward dynamics, the mass matrix, energy and momentum, and the derivatives of
// these.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/derivatives/dynamics/dynamics_derivatives.h"
#include "counterpoint/engine/dynamics/inertial_parameters.h"
#include "counterpoint/engine/dynamics/integrator.h"
#include "counterpoint/engine/forces/effort_limits.h"
#include "counterpoint/engine/forces/springs.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

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

  // Mass, energy and momentum.

  double total_mass() const;       ///< of all bodies that can move [kg]
  Vector3 center_of_mass() const;  ///< of these, in W [m]; NaN where there are none
  double kinetic_energy() const;   ///< [J], rotor inertia (armature) included
  /// [J], zero where a body's centre of mass is in the plane through the world's origin across
  /// gravity; of what is left of the weight where some is carried. Springs by themselves:
  /// springs.h.
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
