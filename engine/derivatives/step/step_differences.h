// Derivatives of the inverse step by differences of the whole step: the reference for closed forms.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// Scratch memory of the differences, which grows and is reused.
struct DifferenceScratch {
  VectorX q, v, v_next, direction;
  Inverse plus, minus;
  MatrixX wide, wide_contacts;  ///< derivatives with the larger step
};

struct DifferenceOptions {
  double step;        ///< [m, rad]
  bool extrapolated;  ///< from steps s and 2 s
  bool by_v_next;     ///< whether to compute du/dv+; else it stays
};

/// Computes step_inverse_derivatives by differences, without `out`: of contact forces by all
/// arguments that are asked for.
void difference_step_inverse(const InverseArguments& of, Workspace& workspace,
                             const DifferenceOptions& how, DifferenceScratch& scratch,
                             InverseDerivatives& d);

/// Returns the step of velocities [m/s, rad/s] for a step of configurations [m, rad]; h [s].
double velocity_difference_step(double step, double h);

/// Returns a difference step [m, rad] suitable for the smoothing of the constraints, if there are
/// any.
double suitable_difference_step(const SimulationOptions& options, bool constrained);

}  // namespace counterpoint
