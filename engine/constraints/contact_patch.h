// Friction of faces and lines that spin, as under an even pressure.
//
// Contacts of faces and lines are points at their ends, which decide when a body tips. For a spin
// about the normal the lever arm of their friction is too long: a disc on four points of its rim is
// braked by mu N R, under an even pressure by 2/3 mu N R; a line of length 2 l by mu N l instead of
// mu N l / 2. Also, the friction of two points across a line cancels for every mean velocity
// between theirs: a wheel that turns rolls on one of its edges. The contacts of a pair that lie in
// one plane are therefore changed by the spin fraction sigma:
//
//   faces   mu is reduced by (1 - lambda) sigma, lambda the mean distance of the face's points
//           from its middle over that of the contacts
//   lines   friction acts across the line, at c + n x (x - c) / 2, sigma of the way there: it
//           resists a spin by mu N l / 2, and has no force where the line's middle rolls
//
// with sigma = s / (1 + s), s = (w r)^2 / (v^2 + v0^2), w the spin, r the mean distance of the
// contacts from their middle c, v the velocity there, all at the start of the step. Sliding without
// spin keeps friction at the loaded points, and contacts at rest hold as before.
#pragma once

#include <array>
#include <span>

#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

/// Contacts of two geometries in one plane that touch or nearly touch, and their relative motion.
struct ContactPatch {
  static constexpr int kMost = 8;
  int size = 0;
  std::array<size_t, kMost> contact;  ///< index into ConstraintSet::contacts
  std::array<Vector3, kMost> place;   ///< contact points in W [m]
  std::array<double, kMost> gap;      ///< [m]
  Vector3 normal = Vector3::Zero();
  Motion motion;         ///< initial velocity of B relative to A at the world origin, in W
  double reach = 0.0;    ///< contacts with at least this gap do not belong to the patch [m]
  double at_rest = 0.0;  ///< speed [m/s] below which sliding and spinning count as rest
  bool round = false;    ///< the patch is the end of a cylinder
  bool spread = false;   ///< the contacts lie within the face (collision/pairs/patch_area.h)
};

/// Changes of the friction of a patch's contacts.
struct PatchFriction {
  std::array<double, ContactPatch::kMost> strength;  ///< remaining fraction of sliding friction
  std::array<Vector3, ContactPatch::kMost> friction_point;  ///< PairConstraint::friction_point [m]
};

/// Collects the contacts first, first + 1, ... of one pair of geometries as a patch and returns the
/// index of the first contact of the next pair. out.size is 0 if they form no patch. Requires
/// compute_velocities.
/// @param radii  radius of each body [m] (collision::body_radii)
size_t find_patch(const StepContext& at, const Kinematics& data, const ConstraintSet& set,
                  std::span<const double> radii, size_t first, ContactPatch& out);
/// Returns false if the patch does not spin; its friction is then unchanged.
bool find_friction(const ContactPatch& patch, PatchFriction& out);

/// Sets `friction_point`, `strength`, `spins` and the friction of all contacts in `out`. Other
/// arguments as for find_patch.
void spread_friction(const StepContext& at, const Kinematics& data, std::span<const double> radii,
                     ConstraintSet& out);

/// Mean distance [m] from the origin of points spread evenly over a polygon around it, given by up
/// to 8 corners in any order, or over a segment through it. round: all corners lie on a circle
/// about the origin, and the region is the disc.
double mean_distance(std::span<const Eigen::Vector2d> corners, bool round);

}  // namespace counterpoint
