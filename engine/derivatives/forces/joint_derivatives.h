// Derivatives of forces on single joint coordinates in a step: rotors, dampers, springs, servos,
// limits, dry friction, mimic joints.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/inverted_step.h"

namespace counterpoint {

/// Adds the derivatives of rotors, dampers, springs and servos in a step of h [s].
void add_joint_force_derivatives(const Model& model, EffectSet effects, double h,
                                 InverseDerivatives& d);

/// Adds the derivatives of the rows `joints` at v_next (nv). displacing: these rows only displace
/// bodies (overlap_correction.h).
void add_joint_row_derivatives(const SimulationOptions& options,
                               const std::vector<JointConstraint>& joints, const VectorRef& v_next,
                               const InverseWeights& weights, InverseDerivatives& d,
                               bool displacing = false);

}  // namespace counterpoint
