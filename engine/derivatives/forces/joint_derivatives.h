// Derivatives of what acts on single joint coordinates in a step: rotors, dampers, springs, servos,
// limits, dry friction, mimics.
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Adds those of rotors, dampers, springs and servos.
void add_joint_force_derivatives(const Model& model, EffectSet effects, double h,
                                 InverseDerivatives& d);

/// Adds those of the rows `joints` at v_next, of a step from q. displacing: they only displace
/// (overlap_correction.h).
void add_joint_row_derivatives(const SimulationOptions& options,
                               const std::vector<JointConstraint>& joints, const VectorRef& v_next,
                               const InverseWeights& weights, InverseDerivatives& d,
                               bool displacing = false);

}  // namespace counterpoint
