// Contacts whose motion has a closed form.
#pragma once

#include "counterpoint/engine/derivatives/constraints/contact_motion.h"

namespace counterpoint {

/// Relative to the shapes' size: what lies closer together is one.
inline constexpr double kSamePlace = 1e-9;

/// A solid's core point, a corner, or as the centre of a ball, against a plane. side: -1 if the
/// plane is A's, 1 if it is B's. False if the contact is none of such a point. The rest as in
/// ContactMotionFinder::find.
bool touches_plane(const Shape& solid, const Pose& X_WG, const collision::Candidate& contact,
                   double towards_b, double side, ContactMotion& out);

/// Two balls about points c_A, c_B of segments, that slide as long as c_B - c_A is across them:
/// spheres and capsules. False if the contact is none of such points.
/// Parameters: what it depends on, one by one.
bool rounds_touch(const Shape& shape_a, const Pose& X_WA, const Shape& shape_b, const Pose& X_WB,
                  const collision::Candidate& contact, double towards_b, ContactMotion& out);

}  // namespace counterpoint
