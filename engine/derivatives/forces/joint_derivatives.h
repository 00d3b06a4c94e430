// Derivatives of forces on single joint coordinates in a step: rotors, dampers, springs, servos,
// limits, dry friction, mimic joints; and on tendons.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/inverted_step.h"

namespace counterpoint {

/// Adds the derivatives of rotors, dampers, springs and servos in a step of h [s].
void add_joint_force_derivatives(const Model& model, EffectSet effects, double h,
                                 InverseDerivatives& d);

/// Adds the derivatives of the rows `constraints.joints` at v_next (nv), with constant
/// coefficients. displacing: these rows only displace bodies (overlap_correction.h).
void add_joint_row_derivatives(const SimulationOptions& options, const ConstraintSet& constraints,
                               const VectorRef& v_next, const InverseWeights& weights,
                               InverseDerivatives& d, bool displacing = false);

/// Adds what the moment arms of spatial tendons, the coefficients of their rows, change with q.
void add_tendon_curvature(const InvertedStep& inverted, const Model& model, double h,
                          const VectorRef& v_next, TendonCurvature& scratch, InverseDerivatives& d);

}  // namespace counterpoint
