// What a step and its inverse are functions of: their arguments, and everything that follows from
// (q, v) alone. The parts of a step read it; none changes it.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/forces/energy_projection.h"
#include "counterpoint/engine/forces/free_flight.h"
#include "counterpoint/engine/forces/mid_velocity.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/velocity_predictor.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Of step_forward: from `state` on, under `input`.
struct StepArguments {
  const Model& model;
  const SimulationOptions& options;
  const contact::Settings& settings;
  const State& state;
  const Input& input;
  EffectSet effects;  ///< those that act in the step

  double h() const { return options.time_step; }  ///< [s]
  StepContext context() const { return {model, options, effects, state.q, state.v}; }
};

/// Of step_inverse: from (q, v) to (q_next, v_next), with what is known of the input.
struct InverseArguments {
  const Model& model;
  const SimulationOptions& options;
  const VectorRef& q;       ///< nq
  const VectorRef& v;       ///< nv
  const VectorRef& q_next;  ///< nq, or empty where the integrator does not need it
  const VectorRef& v_next;  ///< nv
  const Input& known;
  EffectSet effects;          ///< those that act in the step
  bool exact_q_next = false;  ///< q_next is no rounded one: differences vary it apart from v_next

  double h() const { return options.time_step; }  ///< [s]
  StepContext context() const { return {model, options, effects, q, v}; }
};

/// Everything of a step that follows from (q, v) alone, so that the inverse, which knows no more,
/// sees what the forward step saw. Only prepare_step changes it; kinematics and velocity-dependent
/// forces are beside it, in Workspace::Impl::data. It keeps its memory from step to step.
class StepStart {
 public:
  explicit StepStart(const Model& model);
  StepStart(const StepStart&) = delete;
  StepStart& operator=(const StepStart&) = delete;

  /// Contacts, closures, limits, friction, mimic joints with their laws and final biases. The step
  /// works on a copy, to which it adds what input and solution call for.
  const ConstraintSet& constraints() const { return constraints_; }
  const Vector3& gravity() const { return gravity_; }  ///< [m/s^2]; zero where it is off
  const VelocityPredictor& predictor() const { return predictor_; }
  const FreeFlight& free_flight() const { return free_flight_; }
  const EnergyProjection& energy_projection() const { return energy_projection_; }
  /// To which speeds are scaled right [-] (EnergyProjection::set_tolerance).
  void set_projection_tolerance(double tolerance) { energy_projection_.set_tolerance(tolerance); }

 private:
  friend const StepStart& prepare_step(const StepContext&, Workspace::Impl&);
  void find_constraints(const StepContext& at, Workspace::Impl& ws);
  void set_mean_forces(const StepContext& at, Workspace::Impl& ws);
  void predict_equalities(const StepContext& at, Workspace::Impl& ws);
  void add_rest(const Model& model, const VectorRef& v, int t, double share, Workspace::Impl& ws);

  ConstraintSet constraints_;
  Vector3 gravity_ = Vector3::Zero();
  FreeFlight free_flight_;
  VelocityPredictor predictor_;
  MidVelocity mid_velocity_;
  EnergyProjection energy_projection_;
  VectorX other_;  ///< nv: what velocity-dependent forces are taken at beside v
};

/// Fills ws.start for a step from (q, v) of all that is awake (ws.sleepers), after waking what that
/// touches. Leaves kinematics, gravity and velocity-dependent forces at (q, v) in ws.data, as far
/// as the integrator takes them there; no applied forces. Of runge_kutta_4 nothing is known ahead.
const StepStart& prepare_step(const StepContext& at, Workspace::Impl& ws);

/// step_inverse (step.h), by its arguments.
void invert_step(const InverseArguments& step, Workspace::Impl& ws, Inverse& out);

}  // namespace counterpoint
