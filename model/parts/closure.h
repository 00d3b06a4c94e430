// Closures: constraints between two bodies beyond the joints of the trees. Switched ones act only
// while they are attached (docs/guide/closures.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

enum class ClosureType : unsigned char {
  kBall,         ///< the anchors coincide (3 rows)
  kWeld,         ///< the anchor frames coincide (6 rows)
  kDistance,     ///< the anchors keep their distance, like a massless rod (1 row)
  kHinge,        ///< the anchors coincide and the z axes of their frames are parallel (5 rows)
  kSlider,       ///< B's anchor stays on the z axis of A's anchor frame (2 rows)
  kPrismatic,    ///< a slider whose anchor frames keep one orientation (5 rows)
  kCylindrical,  ///< a slider whose frames keep their z axes parallel (4 rows)
  kScrew,        ///< cylindrical, and every turn of B about z moves it by the pitch (5 rows)
};
inline constexpr int kNumClosureTypes = 8;
/// Returns the name in a scene file: "ball", "weld", "distance", "hinge" ...
const char* closure_type_name(ClosureType type);
/// Whether a closure of this type holds angles.
bool holds_angles(ClosureType type);

/// Spring and damper in place of the rigid rows of a closure, along the axes of A's anchor frame; a
/// distance uses the first component.
struct ClosureSpring {
  bool acts = false;                    ///< false: the rows are rigid
  Vector3 stiffness = Vector3::Zero();  ///< [N/m], of angles [N m/rad]
  Vector3 damping = Vector3::Zero();    ///< [N s/m], of angles [N m s/rad]
};

/// A constraint between two bodies in addition to the tree joints, which closes a kinematic loop.
struct Closure {
  std::string name;  ///< unique
  ClosureType type = ClosureType::kBall;
  int body_a = 0, body_b = 0;  ///< either may be the world
  Pose X_AC, X_BC;      ///< anchor frames in the body frames; kBall, kDistance: rotation unused
  double length = 0.0;  ///< distance of the anchors [m], for kDistance
  double pitch = 0.0;   ///< way along z per turn of B [m], for kScrew; negative: left-handed
  bool rope = false;    ///< kDistance: it only pulls, where the anchors are farther apart
  ClosureSpring linear, angular;   ///< springs of the rows of displacement, and of angles
  int frame_a = -1, frame_b = -1;  ///< frames of the two links; -1: the world
  /// It acts only while it is attached, as its first internal state says: kAttached, kReleased or
  /// kBroken. An input changes it (Input::attach).
  bool switched = false;
  bool attached = true;  ///< initially
  /// It breaks after a step in which its force [N] or its torque about the place where it acts
  /// [N m] was larger.
  double breaking_force = std::numeric_limits<double>::infinity();
  double breaking_torque = std::numeric_limits<double>::infinity();
  /// A weld that holds the bodies in the pose where they are when it is attached: pose of B's
  /// anchor frame in A's, seven more internal states (x y z [m] qw qx qy qz). It acts at A's
  /// anchor.
  bool in_place = false;
  int z_index = 0;  ///< first of its internal states (Model::nz), if it is switched
  int num_states() const { return switched ? (in_place ? 8 : 1) : 0; }

  static constexpr double kAttached = 1.0, kReleased = 0.0, kBroken = -1.0;
  /// Whether it acts at internal states z (nz).
  bool acts(const VectorRef& z) const { return !switched || z[z_index] == kAttached; }
  /// Whether a force or torque breaks it.
  bool can_break() const { return std::isfinite(breaking_force) || std::isfinite(breaking_torque); }
  /// Frame in body B that it makes coincide with A's anchor frame at internal states z (nz): B's
  /// anchor frame; in place the one where A's anchor frame was when it was attached.
  Pose anchor_b(const VectorRef& z) const;
};
/// Returns the number of scalar constraints of a closure, springs included.
int num_rows(const Closure& closure);

/// Returns the pose of B's anchor frame in A's at poses of the two bodies, as internal states
/// store it: x y z [m] qw qx qy qz.
Eigen::Matrix<double, 7, 1> pose_in_place(const Closure& closure, const Pose& X_WA,
                                          const Pose& X_WB);

/// Error of a closure at given poses: by how far the anchors are from where the rigid rows hold
/// them [m]; and the angle between the anchor frames, or their z axes, where it is held [rad]. A
/// distance that is too short is negative, of a rope it is zero; springs have no error.
struct ClosureGap {
  double distance = 0.0, angle = 0.0;
  /// The larger magnitude of both numbers [m or rad].
  double largest() const { return std::max(std::abs(distance), angle); }
};
ClosureGap closure_gap(const Closure& closure, const std::vector<Pose>& X_WB);
/// The same at internal states z (nz): zero of a closure that does not act.
ClosureGap closure_gap(const Closure& closure, const std::vector<Pose>& X_WB, const VectorRef& z);

/// Returns the energy in the springs of a closure at given poses [J].
double spring_energy(const Closure& closure, const std::vector<Pose>& X_WB);
/// The same at internal states z (nz): zero of a closure that does not act.
double spring_energy(const Closure& closure, const std::vector<Pose>& X_WB, const VectorRef& z);

/// Error of the thread of a screw, modulo its pitch [m]: X_AB: pose of B's anchor frame in A's. The
/// turn of B follows from the pose alone, without a count of past turns: a screw that is open by
/// less than half a pitch closes to the nearest turn.
double thread_error(const Closure& closure, const Pose& X_AB);

}  // namespace counterpoint
