// The arguments that the forces and constraints of a step depend on.
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// A model at (q, v), and the options of the step.
struct StepContext {
  const Model& model;
  const SimulationOptions& options;
  EffectSet effects;        ///< effects that act in the step
  VectorRef q;              ///< nq
  VectorRef v;              ///< nv
  VectorRef z = VectorX();  ///< nz, internal states; or empty where nothing that has some acts

  double h() const { return options.time_step; }  ///< [s]
};

}  // namespace counterpoint
