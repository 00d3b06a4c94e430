// Closed-form derivatives of contacts.
#pragma once

#include "counterpoint/engine/derivatives/constraints/contact_motion.h"

namespace counterpoint {

/// Points closer together than this, relative to the shapes' size, count as the same point.
inline constexpr double kSamePlace = 1e-9;

/// Differentiates the contact of a core point of a solid (a corner, or the centre of a ball) with a
/// plane. side: -1 if the plane is A, 1 if it is B. Returns false if no core point makes this
/// contact. The other arguments are those of ContactMotionFinder::find.
bool touches_plane(const Shape& solid, const Pose& X_WG, const collision::Candidate& contact,
                   double towards_b, double side, ContactMotion& out);

/// Differentiates the contact of two spheres or capsules: balls about points c_A, c_B of segments,
/// which slide along them as long as c_B - c_A is perpendicular. Returns false if no such points
/// make this contact.
bool rounds_touch(const Shape& shape_a, const Pose& X_WA, const Shape& shape_b, const Pose& X_WB,
                  const collision::Candidate& contact, double towards_b, ContactMotion& out);

}  // namespace counterpoint
