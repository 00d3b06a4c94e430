// Derivatives of steps and their inverse by state and input, and by figures of the model. Those of
// inverse and forward dynamics without contacts: dynamics.h.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

// ---- Derivatives of a step, of its inverse and forward, in the tangent space at q.
//
//   inverse   u  = u(q, v, v+)            what step_inverse recovers
//   forward   v+ = v+(q, v, u)            what step_forward leads to: u(q, v, v+) = u solved for v+
//
// A displacement dq (nv) of a configuration means q (+) dq, as integrate_configuration with h = 1
// moves it: along the joint's axes, rotations of quaternions in the axes of the body, as the
// velocities of the state are. docs/explanation/derivatives.md has formulas and says where they
// jump.

/// How derivatives are found.
enum class DerivativeMethod {
  kAnalytic,            ///< in closed form
  kCentralDifferences,  ///< of the whole step, O(difference step^2): the reference
  kExtrapolated,        ///< of two step sizes, extrapolated (Richardson): O(difference step^4)
};

/// Of step_inverse: applied force (rows, nv) by what it was recovered from (columns, nv).
struct InverseDerivatives {
  MatrixX dq;       ///< du/dq [N/m, N/rad, N m/m, N m/rad], dq a displacement at q
  MatrixX dv;       ///< du/dv [N s/m, ...]
  MatrixX dv_next;  ///< du/dv+ [N s/m, ...]; symmetric where all laws are convex
  /// dq and dv are by extrapolated differences of the whole step, though closed forms were asked
  /// for: something acts that has none (docs/explanation/derivatives.md).
  bool by_differences = false;
};

/// What a step at (q, v) that led to v_next under `known` recovers, into `out` as step_inverse
/// does, and its derivatives into `d`, which is sized here; nothing is allocated once sizes have
/// been seen. `known` stays as it is: wrenches (in world axes), servo targets and positions are
/// held. Where out.fault says that forces are not known, derivatives are NaN.
/// @param q_next  at the end: of implicit_midpoint with constraints, else not looked at and may be
/// null. It says which step; what is differentiated is u(q, v, v+), and q_next goes with these.
/// @param difference_step  of configurations [m, rad]; of velocities it is this over the time step,
/// at most 1e-4 m/s. 0: 1e-6, with constraints 1e-5 of their smoothing length, at least 1e-10.
/// Looked at by differences only.
/// @throws InputError where step_inverse does.
void step_inverse_derivatives(
    const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
    VectorRef q_next, VectorRef v_next, const Input& known, Workspace& workspace, Inverse& out,
    InverseDerivatives& d, DerivativeMethod method = DerivativeMethod::kAnalytic,
    double difference_step = 0.0);  // Parameters: what it depends on, one by one
inline void step_inverse_derivatives(
    const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
    VectorRef v_next, const Input& known, Workspace& workspace, Inverse& out, InverseDerivatives& d,
    DerivativeMethod method = DerivativeMethod::kAnalytic,
    double difference_step = 0.0) {  // Parameters: what it depends on, one by one
  step_inverse_derivatives(model, options, q, v, VectorX(), v_next, known, workspace, out, d,
                           method, difference_step);
}

/// Of step_forward: the state at the end by that at the start and the applied force, nv x nv each.
/// dq_next are displacements at the q_next of the step.
struct ForwardDerivatives {
  MatrixX dv_dq, dv_dv, dv_du;
  MatrixX dq_dq, dq_dv, dq_du;
  /// Beside h v_next the step displaces bodies (overlap_correction.h), and the above know it.
  bool displaces = false;
  MatrixX dq_dv_next;  ///< where it does: what of dq_next goes by v_next alone
};

/// Derivatives of the step from (q, v) under `known`, which led to v_next (and q_next, as above):
/// by one linear solve from those of the inverse, which are left in `inverse` and `d_inverse`.
/// known.applied_force is not looked at. Of runge_kutta_4, which has no inverse, by the chain rule
/// of its stages: v_next and `method` are not looked at then, forces of `inverse` and `d_inverse`
/// are NaN, and known.applied_force is what acted. False if du/dv+, or M, is singular: `d` is NaN
/// then.
/// @throws InputError where step_inverse, or the Runge-Kutta step, does.
bool step_forward_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& inverse, InverseDerivatives& d_inverse,
                              ForwardDerivatives& d,  // Parameters: what it depends on, one by one
                              DerivativeMethod method = DerivativeMethod::kAnalytic);
inline bool step_forward_derivatives(const Model& model, const SimulationOptions& options,
                                     VectorRef q, VectorRef v, VectorRef v_next, const Input& known,
                                     Workspace& workspace,
                                     Inverse& inverse,  // Parameters: all it depends on
                                     InverseDerivatives& d_inverse, ForwardDerivatives& d,
                                     DerivativeMethod method = DerivativeMethod::kAnalytic) {
  return step_forward_derivatives(model, options, q, v, VectorX(), v_next, known, workspace,
                                  inverse, d_inverse, d, method);
}

// ---- Derivatives of a step by parameters of the model and of the laws: of its inverse, and of the
// forward step by one product with step_forward_derivatives.
//
//   inverse   u = u(q, v, v+, p)            du/dp
//   forward   v+ = v+(q, v, u, p)           dv+/dp = -dv+/du du/dp,   dq+/dp = -dq+/du du/dp
//
// docs/explanation/derivatives.md has formulas, and says what is by differences.

enum class StepParameterKind {
  kInertia,            ///< of bodies: along `changes` of their inertial parameters
  kFriction,           ///< of geometries [-]
  kRestitution,        ///< of geometries [-]
  kTorsionalFriction,  ///< of geometries [m]
  kRollingFriction,    ///< of geometries [m]
  kHeight,             ///< shift of geometries along `directions`, against their bodies [m]
  kDamping,            ///< of coordinates of v [N s/m, N m s]
  kDryFriction,        ///< of coordinates of v [N, N m]
  kArmature,           ///< of coordinates of v [kg, kg m^2]
  kGravity,            ///< its size [m/s^2]
  kCompliance,         ///< ContactOptions::compliance [-]
  kSmoothing,          ///< ContactOptions::smoothing [m]
  kStabilization,      ///< ContactOptions::stabilization [-]
  kMaxRecoverySpeed,   ///< ContactOptions::max_recovery_speed [m/s]
};

/// One figure, of all targets together.
struct StepParameter {
  StepParameterKind kind = StepParameterKind::kInertia;
  std::vector<int> targets;                 ///< bodies, geometries, coordinates, or none
  std::vector<InertialParameters> changes;  ///< kInertia: of each target, a unit of the parameter
  /// kHeight: of each target the direction of its shift, of unit length, in the geometry's axes;
  /// none: its z axis.
  std::vector<Vector3> directions = {};

  /// kHeight: the direction of target `index`.
  Vector3 direction(std::size_t index) const {
    return directions.empty() ? Vector3(Vector3::UnitZ()) : directions[index];
  }
};

/// The mass of a body, its centre and its radii of gyration held [kg].
StepParameter mass_parameter(const Model& model, int body);
/// A factor of a body's rotational inertia about its centre of mass [-].
StepParameter inertia_scale_parameter(const Model& model, int body);
/// All ten inertial parameters of every body, in the order of inertial_parameters(model).
std::vector<StepParameter> inertial_step_parameters(const Model& model);

/// Adds `by` to a parameter. @throws InputError where no model may have that.
void change_parameter(const StepParameter& parameter, double by, Model& model,
                      SimulationOptions& options);

struct InverseParameterDerivatives {
  MatrixX du;  ///< nv x number of parameters: du/dp [N, N m over the parameter's unit]
  /// By parameter: extrapolated differences of the whole step, since something acts on which it
  /// has no closed form.
  std::vector<char> by_differences;
};

/// Scratch of one thread for one model and one list of parameters.
class ParameterDerivator {
 public:
  /// How the inverse weights (inverse_weights.h) go with inertia is found here, once, by
  /// extrapolated differences. @throws InputError where a parameter has no such target.
  ParameterDerivator(const Model& model, std::vector<StepParameter> parameters);
  ~ParameterDerivator();
  ParameterDerivator(ParameterDerivator&&) noexcept;
  ParameterDerivator& operator=(ParameterDerivator&&) noexcept;

  const std::vector<StepParameter>& parameters() const;

  /// step_inverse with these arguments, into `out`, and its derivatives at the model's figures.
  /// NaN where out.fault says that forces are not known. Nothing is allocated once sizes have been
  /// seen, but for parameters that come by differences for the first time. Semi-implicit Euler in
  /// closed form, implicit_midpoint by differences.
  /// @throws InputError where step_inverse does.
  void inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
               VectorRef v_next, const Input& known, Workspace& workspace, Inverse& out,
               InverseParameterDerivatives& d,
               DerivativeMethod method =
                   DerivativeMethod::kAnalytic);  // Parameters: what it depends on, one by one

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// dv+/dp and dq+/dp (nv x number of parameters) of the step that `d` is of. Where it displaces,
/// what parameters make of that is left out.
void forward_parameter_derivatives(const ForwardDerivatives& d, const MatrixX& du, MatrixX& dv_dp,
                                   MatrixX& dq_dp);

}  // namespace counterpoint
