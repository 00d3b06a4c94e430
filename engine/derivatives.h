// Derivatives of a step and of its inverse by state, input and parameters of the model. dynamics.h
// has the derivatives of inverse and forward dynamics without contacts.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

// ---- Derivatives of the forward step and of its inverse, in the tangent space at q.
//
//   inverse   u  = u(q, v, v+)            evaluated by step_inverse
//   forward   v+ = v+(q, v, u)            step_forward solves u(q, v, v+) = u for v+
//
// A displacement dq (nv) of a configuration q means q (+) dq, that is integrate_configuration with
// h = 1: along and about the axes of the joint; rotations of quaternions about body-fixed axes,
// like the velocities of the state. docs/explanation/derivatives.md has the formulas and says where
// derivatives jump.

/// Method by which derivatives are computed.
enum class DerivativeMethod {
  kAnalytic,            ///< closed forms
  kCentralDifferences,  ///< differences of the whole step, error O(step^2): the reference
  kExtrapolated,        ///< differences at two steps, extrapolated (Richardson), error O(step^4)
};

/// Derivatives of the contact forces on chosen bodies, three rows for each [N] in W
/// (contact_force_on) by the same arguments as InverseDerivatives; exact where those are, and only
/// of semi-implicit Euler steps.
struct ContactForceDerivatives {
  std::vector<int> bodies;  ///< set by the caller: indices into Model::bodies
  MatrixX dq, dv, dv_next;  ///< 3 bodies.size() x nv
};

/// Derivatives of the applied force u that step_inverse recovers (rows, nv) by its arguments
/// (columns, nv).
struct InverseDerivatives {
  MatrixX dq;       ///< du/dq [N/m, N/rad, N m/m, N m/rad], dq a displacement at q
  MatrixX dv;       ///< du/dv [N s/m, ...]
  MatrixX dv_next;  ///< du/dv+ [N s/m, ...]; symmetric where all laws are convex
  /// True if dq and dv are extrapolated differences of the whole step although closed forms were
  /// requested: something acts that has no closed form (docs/explanation/derivatives.md).
  bool by_differences = false;
  ContactForceDerivatives contacts;  ///< bodies that the caller has chosen; none by default
};

/// Runs step_inverse for (q, v) and v_next under `known`, with its result in `out`, and computes
/// the derivatives `d` (nv x nv each, resized here). Nothing is allocated once sizes have been
/// seen. `known` is held constant: wrenches (world axes, body-fixed points) and servo targets. If
/// out.fault says that the forces are not known, the derivatives are NaN.
/// @param q_next  configuration at the end (nq), needed by implicit_midpoint with constraints; else
/// unused and may be empty. It only identifies the step: derivatives are those of u(q, v, v+), with
/// q_next a function of these.
/// @param difference_step  of configurations [m, rad]; that of velocities is this over the time
/// step, at most 1e-4 m/s. 0 selects 1e-6, or with constraints other than equalities 1e-5 of their
/// smoothing length, 1e-10 to 1e-6. Only differences use it.
/// @throws InputError where step_inverse does, and if d.contacts has bodies and the integrator is
/// not semi_implicit_euler.
void step_inverse_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& out, InverseDerivatives& d,
                              DerivativeMethod method = DerivativeMethod::kAnalytic,
                              double difference_step = 0.0);
inline void step_inverse_derivatives(const Model& model, const SimulationOptions& options,
                                     VectorRef q, VectorRef v, VectorRef v_next, const Input& known,
                                     Workspace& workspace, Inverse& out, InverseDerivatives& d,
                                     DerivativeMethod method = DerivativeMethod::kAnalytic,
                                     double difference_step = 0.0) {
  step_inverse_derivatives(model, options, q, v, VectorX(), v_next, known, workspace, out, d,
                           method, difference_step);
}

/// Derivatives of step_forward: of the state at the end by the state at the start and the applied
/// force, nv x nv each. dq_next is a displacement at the q_next of the step.
struct ForwardDerivatives {
  MatrixX dv_dq, dv_dv, dv_du;
  MatrixX dq_dq, dq_dv, dq_du;
  /// True if the step displaces bodies in addition to h v_next (overlap_correction.h); the matrices
  /// above include that.
  bool displaces = false;
  MatrixX dq_dv_next;  ///< set if it does: dq_next by v_next, that displacement held
};

/// Computes the derivatives of the step from (q, v) under `known` that led to v_next (and q_next,
/// as above), by one linear solve with the derivatives of the inverse, which are left in `inverse`
/// and `d_inverse`; known.applied_force is not used. runge_kutta_4, which has no inverse, is
/// differentiated by the chain rule over its stages: then v_next and `method` are not used, the
/// forces in `inverse` and `d_inverse` are NaN, and known.applied_force must be the force that
/// acted. Returns false, with NaN in `d`, if du/dv+ (runge_kutta_4: M) is singular or the forces
/// are not known.
/// @throws InputError where step_inverse, or the Runge-Kutta step, does, and for runge_kutta_4 with
/// closures or mimic joints.
bool step_forward_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& inverse, InverseDerivatives& d_inverse,
                              ForwardDerivatives& d,
                              DerivativeMethod method = DerivativeMethod::kAnalytic);
inline bool step_forward_derivatives(const Model& model, const SimulationOptions& options,
                                     VectorRef q, VectorRef v, VectorRef v_next, const Input& known,
                                     Workspace& workspace, Inverse& inverse,
                                     InverseDerivatives& d_inverse, ForwardDerivatives& d,
                                     DerivativeMethod method = DerivativeMethod::kAnalytic) {
  return step_forward_derivatives(model, options, q, v, VectorX(), v_next, known, workspace,
                                  inverse, d_inverse, d, method);
}

// ---- Derivatives of a step by parameters of the model and of the contact laws: of its inverse,
// and of the forward step by one product with the result of step_forward_derivatives.
//
//   inverse   u = u(q, v, v+, p)            du/dp
//   forward   v+ = v+(q, v, u, p)           dv+/dp = -dv+/du du/dp,   dq+/dp = -dq+/du du/dp
//
// docs/explanation/derivatives.md has the formulas and lists the parameters taken by differences.

enum class StepParameterKind {
  kInertia,            ///< inertial parameters of bodies, along `changes`
  kFriction,           ///< friction coefficient of geometries [-]
  kRestitution,        ///< restitution coefficient of geometries [-]
  kTorsionalFriction,  ///< torsional friction of geometries [m]
  kRollingFriction,    ///< rolling friction of geometries [m]
  kHeight,             ///< shift of geometries along `directions`, relative to their bodies [m]
  kDamping,            ///< damping at coordinates of v [N s/m, N m s]
  kDryFriction,        ///< dry friction at coordinates of v [N, N m]
  kBreakawayFriction,  ///< breakaway friction at coordinates of v [N, N m]
  kStribeckSpeed,      ///< Stribeck speed at coordinates of v [m/s, rad/s]
  kArmature,           ///< rotor inertia at coordinates of v [kg, kg m^2]
  kGravity,            ///< magnitude of gravity [m/s^2]
  kCompliance,         ///< ContactOptions::compliance [-]
  kSmoothing,          ///< ContactOptions::smoothing [m]
  kStabilization,      ///< ContactOptions::stabilization [-]
  kMaxRecoverySpeed,   ///< ContactOptions::max_recovery_speed [m/s]
};

/// One scalar parameter, shared by all its targets.
struct StepParameter {
  StepParameterKind kind = StepParameterKind::kInertia;
  std::vector<int> targets;  ///< indices of bodies, geometries or coordinates of v; or none
  std::vector<InertialParameters> changes;  ///< kInertia: per target, d pi / d parameter
  /// kHeight: unit vector of the shift of each target, in the geometry's axes; empty: its z axis.
  std::vector<Vector3> directions = {};

  /// kHeight: the direction for target number `index`.
  Vector3 direction(std::size_t index) const {
    return directions.empty() ? Vector3(Vector3::UnitZ()) : directions[index];
  }
};

/// Returns the mass of a body as a parameter [kg]; its centre of mass and radii of gyration are
/// held.
StepParameter mass_parameter(const Model& model, int body);
/// Returns a scale factor of a body's rotational inertia about its centre of mass [-].
StepParameter inertia_scale_parameter(const Model& model, int body);
/// Returns all ten inertial parameters of every body, in the order of inertial_parameters(model).
std::vector<StepParameter> inertial_step_parameters(const Model& model);

/// Adds `by` to a parameter of `model` or `options`. @throws InputError if the new value is not
/// valid, or if gravity has no direction.
void change_parameter(const StepParameter& parameter, double by, Model& model,
                      SimulationOptions& options);

struct InverseParameterDerivatives {
  MatrixX du;  ///< du/dp, nv x number of parameters [N, N m per unit of p]
  /// Per parameter: 1 if its column is from extrapolated differences of the whole step, because
  /// something acts that has no closed form by it, or because `method` asked for them.
  std::vector<char> by_differences;
};

/// Differentiates inverse steps by parameters. Scratch memory inside: one object per thread, model
/// and list of parameters.
class ParameterDerivator {
 public:
  /// Finds the derivatives of the inverse weights (inverse_weights.h) by inertia and rotors, once,
  /// by extrapolated differences. @throws InputError if a target
  /// does not exist, or kInertia does not have one change for each target.
  ParameterDerivator(const Model& model, std::vector<StepParameter> parameters);
  ~ParameterDerivator();
  ParameterDerivator(ParameterDerivator&&) noexcept;
  ParameterDerivator& operator=(ParameterDerivator&&) noexcept;

  const std::vector<StepParameter>& parameters() const;

  /// Runs step_inverse with these arguments, with its result in `out`, and computes du/dp at the
  /// current parameters of `model` and `options`: NaN if out.fault says that the forces are not
  /// known. Nothing is allocated once sizes have been seen, except when a parameter is first taken
  /// by differences. Semi-implicit Euler is in closed form, implicit_midpoint by differences.
  /// @throws InputError where step_inverse does.
  void inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
               VectorRef v_next, const Input& known, Workspace& workspace, Inverse& out,
               InverseParameterDerivatives& d,
               DerivativeMethod method = DerivativeMethod::kAnalytic);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Computes dv+/dp and dq+/dp (nv x number of parameters) from du/dp (nv x number of parameters) of
/// the inverse and the forward derivatives `d` of the same step. If the step displaces bodies
/// (d.displaces), the change of that displacement is neglected.
void forward_parameter_derivatives(const ForwardDerivatives& d, const MatrixX& du, MatrixX& dv_dp,
                                   MatrixX& dq_dp);

}  // namespace counterpoint
