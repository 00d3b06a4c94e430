// For most users: a scene with its state, steps and their inverse.
#pragma once

#include <optional>

#include "counterpoint/engine/diagnosis/stalled_closure.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step/step_control.h"

namespace counterpoint {

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
  /// also sees where a closure or mimic joint stays open (stalled_closure.h): the report's fault
  /// names it, once in closing_time; with settings().soften_after = 0 (strict) the step fails.
  StepReport step();

  /// Two steps, as long as options().step_control allows, not beyond `until` [s] (step_control.h).
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
