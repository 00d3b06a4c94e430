// What a step and its inverse are functions of, in place of long lists of parameters. The parts of a
// step read it; none changes it.
#pragma once

#include "counterpoint/engine/step.h"

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
};

/// Of step_inverse: from (q, v) to v_next, with what is known of the input.
struct InverseArguments {
  const Model& model;
  const SimulationOptions& options;
  const VectorRef& q;       ///< nq
  const VectorRef& v;       ///< nv
  const VectorRef& v_next;  ///< nv
  const Input& known;
  EffectSet effects;  ///< those that act in the step

  double h() const { return options.time_step; }  ///< [s]
};

}  // namespace counterpoint
