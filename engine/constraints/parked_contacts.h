// Parked contacts: candidates that cannot act within the step and therefore have no rows.
//
//   parked: gap > D + 2 h (closing speed at w),     row after all: gap + h J_N w+ < E
//
// D is parking_gap(), E the end gap (below); the closing speed includes that of friction.
//
// Candidates are found as far as bodies may travel in any direction, and most of them stay open.
// Candidates near enough, judged from (q, w), have rows. The others are examined after the solve;
// those that the velocity reaches get rows and the step is solved again, as for joint limits
// (joint_limits.h). The inverse knows that velocity and finds the same rows.
//
// A contact that ends the step at gap E has the impulse k h / E, a force of its design weight times
// the smoothing length over E. E is so large that this is 1e-9 of the weight: rows of contacts that
// end farther off do not matter. Smoothing above kHardSmoothing fades up to the margin
// (contact_law.h): within the margin all contacts have rows, and beyond it k is hard. A convex cone
// acts at a distance of mu |v_T| h, which therefore counts as closing.
//
// Far pairs: bounding volumes already prove that no contact of the pair needs a row, before the
// step and again with the velocity after it. The bounds imply the two conditions above; they only
// save time.
//
// Inactive contacts: most contacts near enough have no force, as the far corners of a foot on its
// edge. The law tells from the velocity y of the contact alone; beyond its onset it gives k / y:
//
//   inactive: k / (y_N - |mu y_T|) < 1e-10 of the weight of the heavier tree, at w, and no force in
//   the last step;    row after all: the same at w+
//
// Only |mu y_T| of convex friction counts. Open contacts have little smoothing
// (faded_smoothing), so that a few micrometres are enough. Softened laws act farther: with them all
// contacts have rows.
//
// Displacements that recover overlaps (overlap_correction.h) are examined in the same way. Contacts
// of sleeping bodies are never parked, since they wake the bodies (sleep.h).
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

/// Gap [m] within which a contact at rest has rows, for a step of h [s].
double parking_gap(const ContactOptions& options, double h);

/// Returns `contact` with the exact gap and friction of its law in place of the bounds; its spin is
/// still the largest coefficient of all axes.
ParkedContact by_law(ParkedContact contact, const PairConstraint& pair, double h);

/// Whether a contact may act in a step of h [s], judged from its velocity at the start.
bool is_near(const ParkedContact& contact, double parking_gap, double h);

/// Whether a contact gets rows because the body velocities V (data.h) at the end of the step reach
/// it.
bool is_reached(const ParkedContact& contact, const ContactOptions& options, double h,
                const std::vector<Motion>& V, const Kinematics& data);

/// The velocity [m/s] by which a contact is beyond the onset of its force, from the body velocities
/// V: y_N - |mu y_T|, or y_N where the normal impulse does not depend on friction.
double speed_beyond_onset(const PairConstraint& contact, const std::vector<Motion>& V,
                          const Kinematics& data);

/// Whether every contact that a pair may have is parked, at the poses and velocities of `data`.
bool is_far(const FarPair& pair, double parking_gap, double h, const Kinematics& data);

/// Whether is_reached is false for all contacts of the pair.
bool stays_far(const FarPair& pair, const ContactOptions& options, double h,
               const std::vector<Motion>& V, const Kinematics& data);

}  // namespace counterpoint
