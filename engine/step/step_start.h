// The arguments of a step and of its inverse, and everything that follows from (q, v) alone. The
// later stages of a step read these as const objects.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/forces/energy_projection.h"
#include "counterpoint/engine/forces/free_flight.h"
#include "counterpoint/engine/forces/mid_velocity.h"
#include "counterpoint/engine/forces/tendons.h"
#include "counterpoint/engine/forces/velocity_predictor.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

class Sleepers;

/// The arguments of step_forward: a step from `state` under `input`.
struct StepArguments {
  const Model& model;
  const SimulationOptions& options;
  const contact::Settings& settings;
  const State& state;
  const Input& input;
  EffectSet effects;  ///< effects that act in the step
  const VectorX& z;   ///< nz, internal states with closures switched as the input says

  double h() const { return options.time_step; }  ///< [s]
  StepContext context() const { return {model, options, effects, state.q, state.v, z}; }
};

/// The arguments of step_inverse: a step from (q, v) to (q_next, v_next), and the known part of the
/// input.
struct InverseArguments {
  const Model& model;
  const SimulationOptions& options;
  const VectorRef& q;       ///< nq
  const VectorRef& v;       ///< nv
  const VectorRef& q_next;  ///< nq, or empty where the integrator does not need it
  const VectorRef& v_next;  ///< nv
  const Input& known;
  EffectSet effects;  ///< effects that act in the step
  const VectorX& z;   ///< nz, internal states with closures switched as the input says
  /// q_next carries no rounding of poses, since differences vary it independently of v_next.
  bool exact_q_next = false;

  double h() const { return options.time_step; }  ///< [s]
  StepContext context() const { return {model, options, effects, q, v, z}; }
};

/// Everything of a step that follows from (q, v) alone: kinematics, constraints with their laws,
/// velocity-dependent forces. The inverse, which knows (q, v) too, comes to the same bits. Only
/// prepare_step writes it; find_inertias completes it, and set_projection_tolerance serves tests.
/// It keeps its memory from step to step.
class StepStart {
 public:
  explicit StepStart(const Model& model);
  StepStart(const StepStart&) = delete;
  StepStart& operator=(const StepStart&) = delete;

  /// Poses and velocities at (q, v) of the awake bodies; under runge_kutta_4 only where there are
  /// free groups. Inertias are there after find_inertias.
  const Kinematics& kinematics() const { return data_; }
  /// Velocity-dependent forces of the step. Under implicit_midpoint they are those at (q, v), and
  /// the step takes those at its middle.
  const VelocityForces& velocity_forces() const { return data_; }
  /// Contacts, closures, limits, dry friction, mimic joints, tendons with their laws and final
  /// biases. The step works on a copy, to which it adds what input and solution call for.
  const ConstraintSet& constraints() const { return constraints_; }
  /// Lengths and moment arms at q of the tendons of awake trees, where tendons or actuators on them
  /// act.
  const Tendons& tendons() const { return tendons_; }
  const Vector3& gravity() const { return gravity_; }  ///< [m/s^2]; zero where it is off
  const VelocityPredictor& predictor() const { return predictor_; }
  const FreeFlight& free_flight() const { return free_flight_; }
  const EnergyProjection& energy_projection() const { return energy_projection_; }
  /// The rotor inertia that is added to the diagonal of M (nv), zero where armatures are off.
  const VectorX& rotor_inertia(const Model& model, EffectSet effects) const {
    return effects.has(Effect::kArmature) ? model.armature() : no_rotors_;
  }

  /// Completes kinematics() with the inertias of ranges of whole trees, which the threads of the
  /// pool share, if it is not null.
  void find_inertias(const Model& model, std::span<const BodyRange> ranges,
                     contact::ThreadPool* pool);
  void find_inertias(const Model& model);
  /// The relative accuracy to which energy projection scales speeds [-].
  void set_projection_tolerance(double tolerance) { energy_projection_.set_tolerance(tolerance); }

 private:
  friend const StepStart& prepare_step(const StepContext&, Workspace::Impl&);
  void find_constraints(const StepContext& at, ConstraintFinder& finder, Sleepers& sleepers,
                        EffectCounts& counts, contact::ThreadPool* pool);
  void set_mean_forces(const StepContext& at, std::span<const BodyRange> awake);
  void predict_equalities(const StepContext& at, std::span<const BodyRange> awake);
  void add_unprojected_forces(const Model& model, const VectorRef& v, int tree, double share);

  Data data_;
  ConstraintSet constraints_;
  Tendons tendons_;
  bool actuates_tendons_ = false;
  Vector3 gravity_ = Vector3::Zero();
  FreeFlight free_flight_;
  VelocityPredictor predictor_;
  MidVelocity mid_velocity_;
  EnergyProjection energy_projection_;
  VectorX other_;      ///< nv: the second velocity of the bilinear form of mid_velocity.h
  VectorX no_rotors_;  ///< nv: zero
};

/// Sets ws.z to the internal states at which a step from q (nq) acts, and returns it. given: those
/// before the step (nz); empty: the model's. @throws InputError as switch_closures.
const VectorX& set_internal_states(const Model& model, EffectSet effects, const VectorRef& q,
                                   const VectorX& given, const Input& input, Workspace::Impl& ws);

/// Fills ws.start for a step from (q, v) of the awake trees, waking those that they touch
/// (ws.sleepers); finds ws.free_groups and the losses of ws.taut_links, clears ws.motion.external,
/// and adds to ws.counts. Applied forces play no part. Under runge_kutta_4 it finds no constraints
/// and no mean forces.
const StepStart& prepare_step(const StepContext& at, Workspace::Impl& ws);

/// step_inverse (step.h) of these arguments.
void invert_step(const InverseArguments& step, Workspace::Impl& ws, Inverse& out);

}  // namespace counterpoint
