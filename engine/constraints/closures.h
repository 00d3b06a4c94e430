// Closures as constraints of one step: error, acceleration of the error, and rows.
//
//   ball       d = p_B - p_A                        3 rows, in W
//   weld       the same, and the rotation vector    3 + 3 rows, in W
//              that takes A's anchor frame to B's
//   distance   d = |p_B - p_A| - length             1 row, along p_B - p_A
//
// p: the anchors in W. All rows act halfway between the anchors, which conserves linear and angular
// momentum while the closure is open. When both bodies rotate together, the rows see the error in
// rotating axes.
#pragma once

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"

namespace counterpoint {

/// Adds the rows of all closures to `out`, behind the contacts, except for closures between idle
/// bodies. Requires compute_poses and compute_velocities; `acceleration` (num_bodies) is scratch.
void find_closures(const Model& model, const SimulationOptions& options, const Kinematics& data,
                   const InverseWeights& weights, SleepMask idle, std::vector<Motion>& acceleration,
                   ConstraintSet& out);

/// Sets the bias of one of these rows so that the closure closes over the step of h [s] from the
/// poses in `data` to the poses in `reached`, to which the predicted velocities V (num_bodies)
/// lead, instead of by the curvature at the initial velocities. The remaining error is of second
/// order in the error of the prediction, not in h.
void aim_closure(const Closure& closure, const ContactOptions& options, double h,
                 const Kinematics& data, const Kinematics& reached, const std::vector<Motion>& V,
                 PairConstraint& pair);

/// Fraction of this correction that is used if the bodies turn by `turn` [rad] in the step. A
/// closure that cannot close, such as beyond the reach of an arm, may have any prediction, and
/// aiming by it diverges.
double share_aimed(double turn);
/// Derivative of share_aimed [1/rad].
double share_aimed_slope(double turn);

/// Distance of the anchors [m] below which a distance closure has no direction and an arbitrary one
/// is used.
inline constexpr double kNoDirection = 1e-12;

}  // namespace counterpoint
