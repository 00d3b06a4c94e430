// Friction of faces and lines that spin: that of an even pressure.
//
// Faces and lines have contacts at their ends, where they tip. There the friction of a spin about
// the normal has too long an arm: a disc on four points of its rim is braked by mu N R, under an
// even pressure by 2/3 mu N R, a line of length 2 l by mu N l and mu N l / 2. And two points let
// the velocity along a line's friction be anything between theirs without a force: a wheel that
// turns rolls on one of its edges. So of a pair's contacts in one plane, as far as they spin,
// sigma:
//
//   faces   mu is less by (1 - lambda) sigma, lambda the mean distance of the face from its middle
//           over that of the contacts
//   lines   friction acts across the line, at c + n x (x - c) / 2, sigma of the way there: it
//   resists
//           a spin by mu N l / 2, and has no force where the line's middle rolls
//
// with sigma = s / (1 + s), s = (w r)^2 / (v^2 + v0^2), w the spin, r the contacts' mean distance
// from their middle c, v the velocity there, all at the start of the step. What slides without a
// spin has its friction where its load is, and what rests holds as its contacts hold.
#pragma once

#include <array>
#include <span>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Contacts of two geometries in one plane that touch or nearly do, and how these move against each
/// other.
struct ContactPatch {
  static constexpr int kMost = 8;
  int size = 0;
  std::array<size_t, kMost> contact;  ///< index into ConstraintSet::contacts
  std::array<Vector3, kMost> place;   ///< in W [m]
  std::array<double, kMost> gap;      ///< [m]
  Vector3 normal = Vector3::Zero();
  Motion motion;         ///< of B against A at the start of the step, about the origin, in W
  double reach = 0.0;    ///< contacts open by so much and more are none of it [m]
  double at_rest = 0.0;  ///< slower [m/s] than this, sliding and spinning are one: rest
  bool round = false;    ///< the end of a cylinder
};

/// What its contacts become.
struct PatchFriction {
  std::array<double, ContactPatch::kMost> strength;  ///< share of sliding friction that is left
  std::array<Vector3, ContactPatch::kMost> rub;      ///< PairConstraint::rub [m]
};

/// Contacts first, first + 1, ... of one pair of geometries as a patch, up to the one returned,
/// which is of another. out.size is 0 where they are none. Needs compute_velocities.
/// @param radii  of bodies [m] (collision::body_radii)
size_t find_patch(const StepContext& at, const Kinematics& data, const ConstraintSet& set,
                  std::span<const double> radii, size_t first, ContactPatch& out);
/// False where it does not spin, and friction stays as it is.
bool find_friction(const ContactPatch& patch, PatchFriction& out);

/// Sets `rub`, `strength`, `spins` and friction of all contacts in `out`. The other arguments are
/// those of find_patch.
void spread_friction(const StepContext& at, const Kinematics& data, std::span<const double> radii,
                     ConstraintSet& out);

/// Mean distance [m] from the origin of points spread evenly over a polygon around it, given by its
/// corners in any order (up to 8) in the plane, or over a segment through it. round: all corners
/// are on a circle about the origin, and so is the rim between them.
double mean_distance(std::span<const Eigen::Vector2d> corners, bool round);

}  // namespace counterpoint
