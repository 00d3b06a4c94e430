// Contacts of the far corners of two shapes that may turn into each other within a step.
#pragma once

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Adds to `manifold`, which holds the contacts of two separated shapes, those of their corners, each
/// taken as a point (the ends of a capsule as balls) against the other shape, where the gap is below
/// the margin [m]. A manifold holds what faces each other now; a rod hit at one end turns the other
/// one in. Does nothing for planes, terrain and spheres, whose manifolds are whole, for overlapping shapes, and
/// for shapes larger than a few times `travel` [m], the way their surfaces can go within the step.
void add_corner_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                         double margin, double travel, Manifold& manifold);

}  // namespace counterpoint::collision
