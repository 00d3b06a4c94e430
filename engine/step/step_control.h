// Steps as long as their error allows: step doubling, and impacts landed on.
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
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint {

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
                                 double& proposal, State& middle, State& next);  // Parameters: all it depends on

/// The first time [s] after `time` that steps have to end at: `end`, or a multiple of the interval.
double next_landing(const StepControlOptions& control, double time, double end);

}  // namespace counterpoint
