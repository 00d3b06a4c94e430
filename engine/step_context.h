// What a step's forces and constraints are functions of.
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// A model at (q, v), and how it is stepped.
struct StepContext {
  const Model& model;
  const SimulationOptions& options;
  EffectSet effects;  ///< those that act in the step
  VectorRef q;        ///< nq
  VectorRef v;        ///< nv

  double h() const { return options.time_step; }  ///< [s]
};

}  // namespace counterpoint
