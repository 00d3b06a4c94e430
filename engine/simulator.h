// For most users: a scene with its state, steps and their inverse; steps of controlled error.
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

// ---- Steps as long as their error allows: step doubling, and impacts landed on.
//
// A controlled step of length h is two steps of h / 2 by the integrator chosen; one step of h from
// the same state says how far they are off. The halves stand: each is a step of known length, so
// every inverse is that of the integrator. With p the integrator's order, and d the difference of
// the two ends on the configuration manifold, q (-) q in position and T d in velocity, T = 1 s,
//
//   error = max over coordinates |d_i| / ((2^p - 1) h (tolerance + relative_tolerance |v_i|))
//
// so the tolerance is what a second of motion may add, and the error of a run is in proportion to
// it. A step is accepted at error <= 1. It fails to fall as h does where a velocity jumps: such a
// step is shortened until the jump lies within event_tolerance, and then accepted.
//
// Shampine 1985, "Local error estimation by doubling"; Hairer, Norsett, Wanner 1993, II.4.

/// What a controlled step came to.
struct ControlledReport {
  StepReport first, second;  ///< of the halves; the second says whether the step succeeded
  double step = 0.0;         ///< h [s], both halves
  double error = 0.0;        ///< over what is allowed [-]; above 1 where `impact` or `missed`
  int rejected = 0;          ///< lengths that were tried before this one
  int evaluations = 0;       ///< steps computed, by step_forward
  bool impact = false;       ///< a force of contact or limit was switched on within event_tolerance
  bool missed = false;       ///< above the tolerance at min_step
  bool succeeded() const { return second.succeeded(); }
};

/// Advances `state` to `next` over `middle`, by no more than `until` [s], which it lands on.
/// `proposal` [s]: the length to try first; on return that of the next step. A pure function of its
/// arguments. Lengths at which the integrator fails are tried again shorter; at min_step, or where
/// what was given is at fault, the failure is the step's, and `next` must not be trusted.
/// @throws InputError as step_forward, and where options.step_control is not set or `until` is not
/// later than the state.
ControlledReport step_controlled(const Model& model, const SimulationOptions& options,
                                 const contact::Settings& settings, const State& state,
                                 const Input& input, double until, Workspace& workspace,
                                 double& proposal, State& middle,
                                 State& next);  // Parameters: all it depends on

/// The first time [s] after `time` that steps have to end at: `end`, or a multiple of the interval.
double next_landing(const StepControlOptions& control, double time, double end);

// ---- Constraints that nothing can meet: closures and mimic joints that stay open. Each step of
// such a one is a valid solution (what holds the bodies apart yields as much as compliance lets
// it), so only a run shows it. A closure that is far open is to close at
// contact.max_recovery_speed; one that has closed by less than a tenth of that over closing_time,
// which is long enough to leave a singular pose (links in one line), is named.

struct Data;

/// Looks at the states of one run. Its memory is no part of the motion: a run that is resumed from
/// a state is watched anew.
class StalledClosureDetector {
 public:
  explicit StalledClosureDetector(const Model& model);
  ~StalledClosureDetector();
  StalledClosureDetector(StalledClosureDetector&&) noexcept;
  StalledClosureDetector& operator=(StalledClosureDetector&&) noexcept;

  /// The next state will not be the last one's continuation.
  void restart();
  /// After a step; looks some twenty times in closing_time. The closure or mimic joint that stays
  /// open, or no fault.
  Fault look(const Model& model, const SimulationOptions& options, const State& state);

 private:
  /// Since when and from where the error [m or rad] has not come down as it is asked to.
  struct Stall {
    double since = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: it is not far open
    double error = 0.0;
  };
  static bool stalls(const SimulationOptions& options, double time, double error, Stall& stall);

  std::vector<Stall> closures_, mimics_;
  std::unique_ptr<Data> data_;  ///< for poses, where there are closures
  double next_look_ = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: not yet set
};

// ---- A scene with its state.

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
  void reset();  ///< back to the scene's start

  /// Where the named link is now, and how it moves (dynamics.h). @throws InputError if there is
  /// none.
  FrameMotion frame(const std::string& name) const {
    return frame_motion(scene_.model, state_, name);
  }

  /// Applied generalized force and wrenches, kept until changed; zero at first.
  Input& input() { return input_; }

  /// One step. If it fails (see the report) the state is left as it was. Unlike step_forward it
  /// also sees where a closure or mimic joint stays open (StalledClosureDetector): the report's
  /// fault names it, once in closing_time; with settings().soften_after = 0 (strict) the step
  /// fails.
  StepReport step();

  /// Two steps, as long as options().step_control allows, not beyond `until` [s] (step_controlled).
  /// If it fails the state is left as it was.
  ControlledReport step_controlled(double until);
  /// The state between these two steps; after step() the state before it.
  const State& middle() const { return middle_; }
  /// The length that the next controlled step will try [s]: with the state all that a run goes on
  /// from. time_step at first, and after set_state and reset.
  double next_step() const { return next_step_.value_or(options().time_step); }
  void set_next_step(double step) { next_step_ = step; }

  /// The forces of the last step (of a controlled one: of its second half): contacts with point,
  /// normal and force, closures, servos, applied forces. Valid until the next call of this or of
  /// inverse(). @throws InputError where there was no step since construction, set_state or reset.
  const Inverse& last_forces();

  /// How often the code of each effect has run.
  const EffectCounts& effect_counts() const { return workspace_.effect_counts(); }
  /// Trees that nothing outside touched in the last step (Workspace::free_trees).
  std::span<const int> free_trees() const { return workspace_.free_trees(); }

  /// The forces between (q, v) and v_next, beside the wrenches and servo targets of input(); valid
  /// until the next call.
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef v_next);
  /// The same with q at the end of the step, which implicit_midpoint needs (step.h).
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef q_next, VectorRef v_next);

 private:
  void watch(StepReport& report);
  void keep_last(double length, const StepReport& report);

  Scene scene_;
  contact::Settings settings_;
  State state_, middle_, next_;
  std::optional<double> next_step_;
  Input input_;
  /// What last_forces() needs of the last step: how long it was (0: there was none), what acted.
  double last_length_ = 0.0;
  Input last_input_;
  Workspace workspace_;
  StalledClosureDetector watch_;
  Inverse inverse_;
};

}  // namespace counterpoint
