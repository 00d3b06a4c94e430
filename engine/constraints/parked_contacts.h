// Contact candidates that cannot act within the step have no rows: they are parked.
//
//   parked: gap > D + 2 h (closing speed at w),     row after all: gap + h J_N w+ < E
//
// Candidates are found as far as bodies may travel in any direction, and most of them stay open.
// One that is near as judged from (q, w) has rows; the others are examined after the
// solve, and where the velocity leads to them they get rows and the step is solved again, as with
// joint limits (joint_limits.h). The inverse knows that velocity and finds the same.
//
// At the end gap E a contact would give k h / E, the force of the smoothing length times the weight
// of what it moves over E: E is so large that this is 1e-9 of that weight. So it is nothing to the
// step whether a contact that ends farther off has rows or not. Smoothing that is not hard fades up
// to the margin (contact_law.h): within it all contacts have rows, and beyond it k is hard. A
// convex cone gives force at a distance, mu |v_T| h, which therefore counts as closing.
//
// Pairs of geometries that what encloses them parts by more than any of their contacts could need
// to have rows are not even looked at: they are far, at first, and again by the velocity after the
// step. That is by bounds of the two conditions above, so that nothing depends on it but time.
//
// Displacements that recover overlaps (overlap_correction.h) are looked at in the same way.
// Contacts of bodies asleep are never parked: they wake them (sleep.h).
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Gap [m] within which a contact at rest has rows, for a step of h.
double parking_gap(const ContactOptions& options, double h);

/// The same with the gap and the friction that the law of its constraint has, which are no bounds;
/// of spin the largest still counts for all axes.
ParkedContact by_law(ParkedContact contact, const PairConstraint& pair, double h);

/// Whether a contact may act in a step of h, as judged from its velocity at the start.
bool is_near(const ParkedContact& contact, double parking_gap, double h);

/// Whether the body velocities V (data.h) at the end of the step lead to it, so that it gets rows.
bool is_reached(const ParkedContact& contact, const ContactOptions& options, double h,
                const std::vector<Motion>& V, const Kinematics& data);

/// Whether every contact that a pair may have is parked, at the poses and velocities of data.
bool is_far(const FarPair& pair, double parking_gap, double h, const Kinematics& data);

/// Whether none of them is_reached.
bool stays_far(const FarPair& pair, const ContactOptions& options, double h,
               const std::vector<Motion>& V, const Kinematics& data);

}  // namespace counterpoint
