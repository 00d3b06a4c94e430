// The few lines most users need: a scene, its state, step, inverse.
#pragma once

#include "counterpoint/engine/step.h"

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

  /// Applied generalized force and wrenches, kept until changed; zero at first.
  Input& input() { return input_; }

  /// One step. If it fails (see the report) the state is left as it was.
  StepReport step();

  /// How often the code of each effect has run.
  const EffectCounts& effect_counts() const { return workspace_.effect_counts(); }

  /// The forces between (q, v) and v_next, beside the wrenches and servo targets of input(); valid
  /// until the next call.
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef v_next);
  /// The same with q at the end of the step, which implicit_midpoint needs (step.h).
  const Inverse& inverse(VectorRef q, VectorRef v, VectorRef q_next, VectorRef v_next);

 private:
  Scene scene_;
  contact::Settings settings_;
  State state_, next_;
  Input input_;
  Workspace workspace_;
  Inverse inverse_;
};

}  // namespace counterpoint
