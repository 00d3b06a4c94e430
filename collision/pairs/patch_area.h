// Contact points of surfaces with a stiffness per area.
//
// The surfaces press on each other with the pressure k_A d, d the depth of their overlap along the
// contact normal (Winkler's foundation). The force is k_A V, V the volume of the overlap, and its
// energy U the integral of k_A d^2 / 2.
//
// flat faces: all faces of A that look along the normal against all of B that look back. Four
// points replace those of the pair. They have the area of the region of overlap, its centroid and
// its second moments, and their depths have the integral and the first moments of d. The force is
// thus k_A V at the centre of pressure, and the springs of the points resist as the whole region
// does, tilting with k_A I. These are the derivatives of U by the pose but for the pressure on
// walls along the normal, of the order of depth over size.
//
// other features: V is shared among the points in proportion to their depth.
//
//   ball, radius R                    pi R d^2
//   cylinder, length L, on its side   4/3 L d sqrt(2 R d)
//
// A region that grows within the step is the one that it reaches at its present velocity: otherwise
// a face that closes its gap would meet no spring.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Two shapes and the displacement of B relative to A within the step, at the origin of the poses'
/// frame [rad, m].
struct PatchPair {
  const Shape& a;
  const Pose& X_WA;
  const Shape& b;
  const Pose& X_WB;
  Motion displacement;
};

/// A face of a shape, and its bounds in the plane of the contact [m].
struct PatchFace {
  Feature face;
  Eigen::AlignedBox2d bounds;
};

/// Memory for the faces of two shapes that may overlap.
struct PatchFaces {
  std::vector<PatchFace> a, b;
};

/// Spreads the contacts of a pair over their patches and sets the area of each [m^2], 0 for one
/// that neither touches nor will within the step. Contacts of one normal share a patch; terrain
/// counts as the tangent plane at the deepest of them, with the share of the pair's points that
/// have this normal. Points stay where they are if the patches of several normals need more than
/// eight. Two bodies without a face meet as two balls.
void spread_patches(const PatchPair& pair, PatchFaces& scratch, Manifold& contacts,
                    std::array<double, Manifold::kCapacity>& area);

}  // namespace counterpoint::collision
