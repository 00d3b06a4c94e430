// Continuation of a motion estimate: contacts start soft and far-reaching, and harden in stages.
#pragma once

#include <functional>

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

struct MotionContinuation {
  double start = 1e-2, end = 1e-3;  ///< smoothing of the contact law [m]
  int most_steps = 40;              ///< limit of Newton steps per stage
  double tolerance = 3e-3;          ///< relative decrease of the cost, see MotionFit::minimize
  std::function<bool()> stop;       ///< called before every step; true ends the search
};

/// Options of a stage: the problem's laws with this smoothing [m].
SimulationOptions stage_options(const MotionProblem& problem, double smoothing);

struct ContinuationResult {
  double smoothing = 0.0;  ///< smoothing of the last accepted stage [m]
  int steps = 0;
  double cost = 0.0;
  /// Motions of the last stage, and of the last earlier stage with about twice its smoothing or
  /// more (empty if there is none). Their difference shows the effect of smoothing on forces.
  MotionPoint hardest, softer;
  double softer_smoothing = 0.0;
  bool untouched = false;  ///< contacts and limits have no effect: one stage was enough
};

/// Carries `fit` through the stages. A stage whose cost rises by more than a fifth has lost the
/// motion: it is rejected, and a smaller change is tried from the stage before. If the final laws
/// do not change the cost after the first stage, no other stage follows.
ContinuationResult continue_motion(const MotionProblem& problem,
                                   const MotionContinuation& continuation, MotionFit& fit);

}  // namespace counterpoint::estimation
