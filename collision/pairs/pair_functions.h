// One function per pair of shape types, the lower type first. Private: callers use pair_contacts.
//
// All meet the specification of pair_contacts. They are called with A at the origin of the common
// frame, so that no digits are lost far from the world's origin; functions of two spheres or
// capsules take any poses, since moving them would take half their time. `out` is empty on entry.
#pragma once

#include "counterpoint/collision/pairs/pair_contacts.h"

namespace counterpoint::collision {

using PairFunction = void (*)(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                              const PairQuery& query, Manifold& out);

void plane_sphere(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                  Manifold&);
void plane_box(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&, Manifold&);
void plane_capsule(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                   Manifold&);
void plane_cylinder(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                    Manifold&);
void plane_convex_mesh(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                       Manifold&);
void sphere_sphere(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                   Manifold&);
void sphere_box(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&, Manifold&);
void sphere_capsule(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                    Manifold&);
void sphere_cylinder(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                     Manifold&);
void box_box(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&, Manifold&);
void box_capsule(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&, Manifold&);
void capsule_capsule(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                     Manifold&);
/// Any two convex shapes, no planes, by iteration (GJK, EPA).
void convex_convex(const Shape&, const Pose&, const Shape&, const Pose&, const PairQuery&,
                   Manifold&);

}  // namespace counterpoint::collision
