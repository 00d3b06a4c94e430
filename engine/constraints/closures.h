// Closures as constraints of one step: error, its acceleration, rows.
//
//   ball       d = p_B - p_A                        3 rows, in W
//   weld       the same, and the rotation vector    3 + 3 rows, in W
//              that takes A's anchor frame to B's
//   distance   d = |p_B - p_A| - length             1 row, along p_B - p_A
//
// p: the anchors in W. All rows act halfway between the anchors, so that linear and angular
// momentum are kept while the closure is open; to the rotation of both bodies the error then is one
// seen in axes that turn with them.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Adds the rows of all closures, but between idle bodies, to `out`, behind the contacts. Needs
/// compute_poses and compute_velocities; `acceleration` (num_bodies) is scratch.
void find_closures(const Model& model, const SimulationOptions& options, const Kinematics& data,
                   const InverseWeights& weights, Idle idle, std::vector<Motion>& acceleration,
                   ConstraintSet& out);  // Parameters: what it depends on, one by one

/// Aims the bias of one of these rows at closing in the step of h [s] from `data` to the poses of
/// `reached`, which are those that the velocities V (num_bodies) lead to, rather than by the
/// curvature at the velocities of the start: the error left is second order in how far w+ will be
/// off, not in h.
/// Parameters: what it depends on, one by one.
void aim_closure(const Closure& closure, const ContactOptions& options, double h,
                 const Kinematics& data, const Kinematics& reached, const std::vector<Motion>& V,
                 PairConstraint& pair);

/// How much a closure is aimed if what it holds turns by this [rad] in the step. Where it cannot
/// close, as beyond the reach of an arm, a prediction may be anything, and to aim by it diverges.
double share_aimed(double turn);
/// Its slope [1/rad].
double share_aimed_slope(double turn);

/// Anchors closer than this [m] give a distance no direction; any will do.
inline constexpr double kNoDirection = 1e-12;

}  // namespace counterpoint
