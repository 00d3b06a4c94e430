// How the friction of a patch that spins (contact_patch.h) goes with the motion of its two bodies:
// the share of it that is left, and where it acts. By central differences of find_friction alone,
// which is smooth, in the linear motion of its contacts; what the law makes of them is in closed
// form.
#pragma once

#include <array>

#include "counterpoint/engine/constraints/contact_patch.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/constraints/pair_response.h"

namespace counterpoint {

/// A patch as it is, and how its contacts move, each at its own place.
struct MovingPatch {
  ContactPatch patch;
  std::array<ContactMotion, ContactPatch::kMost> motions;
};

/// Adds that to the response of contact `index` of the patch, which find_contact_response has made.
void add_patch_response(const MovingPatch& moving, int index, const PairConstraint& pair,
                        const PairBodies& bodies, PairResponse& out);

}  // namespace counterpoint
