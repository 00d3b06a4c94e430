// Derivatives of the inverse step by differences of the whole of it: the reference for those in
// closed form.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// Scratch of these differences: grown, then reused.
struct DifferenceScratch {
  VectorX q, v, v_next, direction;
  Inverse plus, minus;
  MatrixX wide;  ///< of the larger step
};

struct DifferenceOptions {
  double step;        ///< [m, rad]
  bool extrapolated;  ///< from steps s and 2 s
  bool by_v_next;     ///< du/dv+ too, else it stays
};

/// As step_inverse_derivatives by differences, without `out`.
void difference_step_inverse(const InverseArguments& of, Workspace& workspace,
                             const DifferenceOptions& how, DifferenceScratch& scratch,
                             InverseDerivatives& d);

/// That of velocities [m/s, rad/s] beside one of configurations [m, rad].
double velocity_difference_step(double step, double h);

/// The step [m, rad] that suits the smoothing of a scene's constraints, if it has any.
double suitable_difference_step(const SimulationOptions& options, bool constrained);

}  // namespace counterpoint
