// Derivatives of the friction of a spinning patch (contact_patch.h) by the motion of its two
// bodies: the share of friction that is left, and the points where it acts. find_friction, which is
// smooth, is differentiated by central differences along the linearized motion of its contacts; the
// law is differentiated in closed form.
#pragma once

#include <array>

#include "counterpoint/engine/constraints/contact_patch.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/constraints/pair_response.h"

namespace counterpoint {

/// A patch and the derivatives of its contacts, each at its own place.
struct MovingPatch {
  ContactPatch patch;
  std::array<ContactMotion, ContactPatch::kMost> motions;
};

/// Adds these derivatives to the response of contact `index` of the patch, found by
/// find_contact_response.
void add_patch_response(const MovingPatch& moving, int index, const PairConstraint& pair,
                        const PairBodies& bodies, PairResponse& out);

}  // namespace counterpoint
