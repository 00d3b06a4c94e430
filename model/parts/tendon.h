// Tendons: lengths that depend on the configuration, and the forces along them.
//
//   fixed     L = sum of coefficient times joint coordinate
//   spatial   L = length of a path through points of bodies, around spheres and cylinders; branches
//             behind a pulley count by the share of its force that they carry
//
// A force F along a tendon acts on the coordinates as F dL/dq; pulling is negative.
#pragma once

#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// A term of a fixed tendon.
struct TendonJoint {
  int joint = 0;             ///< index into Model::joints; a joint of one coordinate
  double coefficient = 1.0;  ///< [m/rad], or without unit
};

/// A point of a path.
struct TendonPoint {
  int body = 0;
  Vector3 position = Vector3::Zero();  ///< in the body frame [m]
};

/// A sphere about the origin of a frame, or an endless cylinder about its z axis, around which a
/// path may run.
struct TendonWrap {
  int body = 0;
  Pose X_BG;
  double radius = 0.0;  ///< [m]
  bool cylinder = false;
  /// Point in the frame G, outside, on whose side the path passes; default: the shorter side.
  std::optional<Vector3> side;
};

/// A part of a path from one point to the next.
struct TendonSegment {
  TendonPoint from, to;
  int wrap = -1;       ///< index into Tendon::wraps, or -1
  double share = 1.0;  ///< part of the force that it carries: 1 over a divisor [-]
};

/// Servo of a tendon: force stiffness (target - L) + damping (speed - dL/dt), together with the
/// force of the input within [least, most], both finite or both infinite.
struct TendonServo {
  double stiffness = 0.0;                                   ///< [N/m]
  double damping = 0.0;                                     ///< [N s/m]
  double target = 0.0;                                      ///< [m]
  double speed = 0.0;                                       ///< [m/s]
  double least = -std::numeric_limits<double>::infinity();  ///< bounds of the force [N]
  double most = std::numeric_limits<double>::infinity();
  bool any() const { return stiffness > 0.0 || damping > 0.0; }
};

/// Units are those of a length in metres. A fixed tendon whose coefficients have no unit has an
/// angle in place of it: then N stands for N m, m for rad.
struct Tendon {
  std::string name;                 ///< unique
  std::vector<TendonJoint> joints;  ///< fixed tendon
  std::vector<TendonSegment> path;  ///< spatial tendon
  std::vector<TendonWrap> wraps;
  double stiffness = 0.0;  ///< stiffness of the spring [N/m]
  double rest_shortest = 0.0,
         rest_longest = 0.0;  ///< lengths between which the spring is slack [m]
  double damping = 0.0;       ///< [N s/m]
  double dry_friction = 0.0;  ///< [N]
  double lower = -std::numeric_limits<double>::infinity();  ///< limits of the length [m]
  double upper = std::numeric_limits<double>::infinity();
  TendonServo servo;
  bool is_spatial() const { return !path.empty(); }
};

/// Length of a segment as a function of the positions a, b of its ends, in world axes, relative to
/// an origin that is fixed in the frame of the wrap (or in any frame, if straight).
struct SegmentLength {
  double length = 0.0;          ///< [m]
  Vector3 by_a, by_b;           ///< gradient [-]
  Matrix3 by_aa, by_ab, by_bb;  ///< second derivatives [1/m]; by_ba = by_ab'
};

/// Returns the length of a straight segment from a to b, with derivatives if `second`.
SegmentLength straight_length(const Vector3& a, const Vector3& b, bool second);

/// Returns the length of a segment around a sphere or cylinder at the origin, whose frame has the
/// rotation R_WG. It is straight where it does not touch, or where an end lies inside. Sphere: with
/// f(s) = sqrt(s^2 - r^2) - r acos(r / s) and the angle theta between a and b,
///
///   L = f(|a|) + f(|b|) + r theta,    around the far side with 2 pi - theta
///
/// Cylinder: the same for the parts of a and b across its axis, and L = sqrt(l^2 + z^2) with the
/// distance z along it, since the surface and the tangent planes unroll into one plane.
SegmentLength wrapped_length(const TendonWrap& wrap, const Matrix3& R_WG, const Vector3& a,
                             const Vector3& b, bool second);

/// Returns the body in whose frame the length of a segment is a function of its ends: that of its
/// wrap, else that of its start.
int reference_body(const Tendon& tendon, const TendonSegment& segment);

/// Returns all bodies of the path, ascending.
std::set<int> path_bodies(const Tendon& tendon);

struct PlacedSegment {
  Vector3 start, end;  ///< the ends in W [m]
  SegmentLength length;
};
/// Returns a segment where the bodies have the poses X_WB, with derivatives of its length if
/// `second`.
PlacedSegment place_segment(const Tendon& tendon, const TendonSegment& segment,
                            const std::vector<Pose>& X_WB, bool second);

}  // namespace counterpoint
