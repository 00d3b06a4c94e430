// Main entry point: a scene with its state, steps, their inverse, and steps with error control.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

// ---- Steps with error control: step doubling, and impacts at the end of a step.
//
// A controlled step of length h consists of two steps of h / 2 by the chosen integrator; one step
// of h from the same state gives the error estimate. The halves are kept: each is a step of known
// length, so every inverse is that of the integrator. With p the order of the integrator, and d the
// difference of the two results on the configuration manifold, q (-) q in position and T d in
// velocity, T = 1 s,
//
//   error = max over coordinates |d_i| / ((2^p - 1) h (tolerance + relative_tolerance |v_i|))
//
// The tolerance is therefore the error that a second of motion may add, and the error of a run is
// proportional to it. A step is accepted if error <= 1. Where a velocity jumps the error does not
// decrease with h: such a step is shortened until the jump lies within event_tolerance, and then
// accepted.
//
// Shampine 1985, "Local error estimation by doubling"; Hairer, Norsett, Wanner 1993, II.4.

/// Report of a controlled step.
struct ControlledReport {
  StepReport first, second;  ///< the halves; `second` says whether the step succeeded
  double step = 0.0;         ///< h [s], both halves
  double error = 0.0;        ///< relative to the tolerance [-]; above 1 if `impact` or `missed`
  int rejected = 0;          ///< number of step lengths tried before this one
  int evaluations = 0;       ///< number of steps computed by step_forward
  bool impact = false;       ///< a contact or limit force switched on within event_tolerance
  bool missed = false;       ///< the error exceeds the tolerance at min_step
  bool succeeded() const { return second.succeeded(); }
};

/// Advances `state` over `middle` to `next`, at most to the time `until` [s], which it hits
/// exactly. proposal [s]: the length to try first; on return that for the next step. A pure
/// function of its arguments. Lengths at which the integrator fails are retried shorter; at
/// min_step, or if an argument is invalid, the step fails, and `next` must not be used.
/// @throws InputError as step_forward, and if options.step_control is not set or `until` is not
/// later than the state.
ControlledReport step_controlled(const Model& model, const SimulationOptions& options,
                                 const contact::Settings& settings, const State& state,
                                 const Input& input, double until, Workspace& workspace,
                                 double& proposal, State& middle, State& next);

/// Returns the first time [s] after `time` at which a step must end: `end`, or a multiple of the
/// interval.
double next_landing(const StepControlOptions& control, double time, double end);

// ---- Closures and mimic joints that cannot close. Each step with such a constraint is a valid
// solution (the obstacles yield as much as compliance allows), so only a run of steps shows it. A
// closure that is far open should close at contact.max_recovery_speed; it is reported if it closes
// by less than a tenth of that over closing_time, which is long enough to leave a singular pose
// (links in one line).

struct Data;

/// Checks the states of one run. Its memory does not affect the motion: a run resumed from a state
/// is checked anew.
class StalledClosureDetector {
 public:
  explicit StalledClosureDetector(const Model& model);
  ~StalledClosureDetector();
  StalledClosureDetector(StalledClosureDetector&&) noexcept;
  StalledClosureDetector& operator=(StalledClosureDetector&&) noexcept;

  /// Announces that the next state does not continue the last one.
  void restart();
  /// Checks the state after a step, about twenty times in closing_time. Returns the closure or
  /// mimic joint that stays open as a fault, or no fault.
  Fault look(const Model& model, const SimulationOptions& options, const State& state);

 private:
  /// Start of the period in which the error [m or rad] has not decreased as demanded, and its value
  /// then.
  struct Stall {
    double since = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: not far open
    double error = 0.0;
  };
  static bool stalls(const SimulationOptions& options, double time, double error, Stall& stall);

  std::vector<Stall> closures_, mimics_;
  std::unique_ptr<Data> data_;  ///< for poses, if there are closures
  double next_look_ = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: not yet set
};

// ---- A scene with its state.

/// A scene with its state: runs steps and their inverse.
class Simulator {
 public:
  explicit Simulator(Scene scene);

  const Scene& scene() const { return scene_; }
  const Model& model() const { return scene_.model; }
  const SimulationOptions& options() const { return scene_.options; }
  SimulationOptions& options() { return scene_.options; }
  contact::Settings& settings() { return settings_; }

  const State& state() const { return state_; }
  void set_state(const State& state);
  void reset();  ///< returns to the scene's initial state, at time 0

  /// Returns pose and velocity of the named link (dynamics.h). @throws InputError if there is no
  /// such link.
  FrameMotion frame(const std::string& name) const {
    return frame_motion(scene_.model, state_, name);
  }

  /// Applied generalized forces and wrenches, used until changed; zero at first.
  Input& input() { return input_; }

  /// Lets threads share each step (Workspace::set_threads).
  void set_threads(int count) { workspace_.set_threads(count); }
  /// Lets each step add its times to `times` (workspace.h); null: no longer.
  void measure_phases(PhaseTimes* times) { counterpoint::measure_phases(workspace_, times); }

  /// Does one step. If it fails (see the report) the state is unchanged. Unlike step_forward it
  /// also detects closures and mimic joints that stay open (StalledClosureDetector): the fault in
  /// the report names one, once in closing_time; with settings().soften_after = 0 (strict) the step
  /// fails.
  StepReport step();

  /// Does two steps, as long as options().step_control allows, not beyond `until` [s]
  /// (step_controlled). If it fails the state is unchanged.
  ControlledReport step_controlled(double until);
  /// State between these two steps; after step() the state before it.
  const State& middle() const { return middle_; }
  /// Length that the next controlled step will try [s]. With the state it is all that a run needs
  /// to continue. It is time_step at first, and after set_state and reset.
  double next_step() const { return next_step_.value_or(options().time_step); }
  void set_next_step(double step) { next_step_ = step; }

  /// Returns the forces of the last step (of the second half of a controlled step): contacts with
  /// point, normal and force, closures, servos, applied forces. Valid until the next call of this
  /// or of inverse(). @throws InputError if there was no step since construction, set_state or
  /// reset.
  const Inverse& last_forces();

  /// Number of times that the code of each effect has run.
  const EffectCounts& effect_counts() const { return workspace_.effect_counts(); }
  /// Trees that nothing outside touched in the last step (Workspace::free_trees).
  std::span<const int> free_trees() const { return workspace_.free_trees(); }

  /// Returns the forces between (q, v) and v_next (sizes and units as in State), given the wrenches
  /// and servo targets of input(); valid until the next call.
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef v_next);
  /// Does the same with q_next at the end of the step, which implicit_midpoint needs (step.h).
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef q_next, VectorRef v_next);

 private:
  void watch(StepReport& report);
  void keep_last(double length, const StepReport& report);

  Scene scene_;
  contact::Settings settings_;
  State state_, middle_, next_;
  std::optional<double> next_step_;
  Input input_;
  /// The last step for last_forces(): its length [s] (0: there was none), and its input.
  double last_length_ = 0.0;
  Input last_input_;
  Workspace workspace_;
  StalledClosureDetector watch_;
  Inverse inverse_;
};

}  // namespace counterpoint
