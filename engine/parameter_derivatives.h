// Derivatives of a step by parameters of the model and of the laws: of its inverse, and of the
// forward step by one product with those of step_derivatives.h.
//
//   inverse   u = u(q, v, v+, p)            du/dp
//   forward   v+ = v+(q, v, u, p)           dv+/dp = -dv+/du du/dp,   dq+/dp = -dq+/du du/dp
//
// docs/explanation/derivatives.md has formulas, and says what is by differences.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/dynamics/inertial_parameters.h"
#include "counterpoint/engine/step_derivatives.h"

namespace counterpoint {

enum class StepParameterKind {
  kInertia,            ///< of bodies: along `changes` of their inertial parameters
  kFriction,           ///< of geometries [-]
  kRestitution,        ///< of geometries [-]
  kTorsionalFriction,  ///< of geometries [m]
  kRollingFriction,    ///< of geometries [m]
  kHeight,             ///< of geometries: along their own z axis, against their bodies [m]
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
