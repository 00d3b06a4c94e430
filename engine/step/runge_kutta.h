// The classical Runge-Kutta method on the configuration manifold, for smooth scenes. Closures and
// mimic joints act through accelerations and projection (equality_motion.h).
//
// The coordinates of a step are the exponents theta of q (+) theta, so that orientations are of
// order four too: theta' = w + theta x w / 2 + theta x (theta x w) / 12 for rotations, with w in
// body axes (Munthe-Kaas 1998; the series of the inverse of the exponential's derivative, truncated
// at order four). It has no discrete inverse: the ends of a step do not determine the forces of its
// four stages.
#pragma once

#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Throws InputError if the scene calls for constraints that are not switched off, or for closures
/// that are springs or ropes.
void refuse_constraints(const Model& model, EffectSet effects);

/// A stage of the method: its time as a share of the step, and its weight in sixths.
struct RungeKuttaStage {
  double node, weight;
};
inline constexpr RungeKuttaStage kRungeKuttaStages[4] = {
    {0.0, 1.0}, {0.5, 2.0}, {0.5, 2.0}, {1.0, 1.0}};

/// Computes theta' (nv) at theta (nv) for velocities w (nv).
void exponent_rate(const Model& model, const VectorX& theta, const VectorX& w, VectorX& rate);

/// Computes the acceleration (nv) of the smooth motion at a stage; leaves its kinematics in
/// ws.stage. All bodies must be awake.
void compute_acceleration(const StepContext& at, const Input& input, Workspace::Impl& ws,
                          VectorX& acceleration, StepReport& report);

/// Advances from the state of `step` to `next`. @throws InputError as refuse_constraints.
void step_runge_kutta(const StepArguments& step, Workspace::Impl& ws, State& next,
                      StepReport& report);

}  // namespace counterpoint
