// How a motion estimate is found: contacts begin soft and far-reaching, and harden stage by stage.
#pragma once

#include <functional>

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

struct MotionContinuation {
  double start = 1e-2, end = 1e-3;  ///< smoothing of the contact law [m]
  int most_steps = 40;              ///< Newton steps of a stage
  double tolerance = 3e-3;          ///< share of the cost, see MotionFit::minimize
  std::function<bool()> stop;       ///< asked before every step
};

/// The laws of a stage: those of the problem, at this smoothing [m].
SimulationOptions stage_options(const MotionProblem& problem, double smoothing);

struct ContinuationResult {
  double smoothing = 0.0;  ///< the last accepted stage's [m]
  int steps = 0;
  double cost = 0.0;
  /// The motions of the last stage, and of the last one before it that was at least nearly twice as
  /// soft (none where there was a single stage): they tell what smoothing does to the forces.
  MotionPoint hardest, softer;
  double softer_smoothing = 0.0;
  bool untouched = false;  ///< contacts and limits do nothing: one stage was enough
};

/// Carries `fit` from its point through the stages. A stage whose cost rises by more than a fifth
/// has lost the motion: it is refused, and a shorter one tried from the stage before. Where the
/// last stage's laws would change nothing after the first stage, it is the only one.
ContinuationResult continue_motion(const MotionProblem& problem,
                                   const MotionContinuation& continuation, MotionFit& fit);

}  // namespace counterpoint::estimation
