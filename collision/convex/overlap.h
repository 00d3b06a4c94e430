// Integrals over the overlap of two features, seen along the contact normal.
#pragma once

#include "counterpoint/collision/convex/feature.h"

namespace counterpoint::collision {

/// Addition to gaps that changes evenly over space: offset + slope . p [m].
struct GapShift {
  double offset = 0.0;
  Vector3 slope = Vector3::Zero();
  double at(const Vector3& p) const { return offset + slope.dot(p); }
};

/// Integrals over the region in which two surfaces overlap, seen along the normal n. Places are
/// along the first two columns of frame_from_normal(n) [m]; fields are the depth and the height
/// along n of the middle between the surfaces [m].
struct OverlapRegion {
  double area = 0.0;                                  ///< [m^2]
  Eigen::Vector2d place = Eigen::Vector2d::Zero();    ///< that of the place [m^3]
  Eigen::Matrix2d places = Eigen::Matrix2d::Zero();   ///< that of place place^T [m^4]
  Eigen::Vector2d fields = Eigen::Vector2d::Zero();   ///< that of the fields [m^3]
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();  ///< that of place fields^T [m^4]
};

/// Adds the region in which two polygons overlap to `now`, and to `later` the one in which they
/// overlap once `shift` is added to their gaps; the depth is that before the shift in both.
/// @param normal  unit, from A to B; polygons that are nearly edge-on add nothing
void add_overlap(const Feature& a, const Feature& b, const Vector3& normal, const GapShift& shift,
                 OverlapRegion& now, OverlapRegion& later);

/// Returns the integral of the depth where a polygon meets a segment or a point, or two of these
/// meet, along the unit vector `normal` from A to B [m^3].
/// @param shift    added to all gaps
/// @param radius   relative radius of curvature of the segment or point [m]
/// @param has_caps the segment or point is the core of a capsule or a ball
/// @param deepest  least gap, used where no polygon meets a segment [m]
double round_overlap(const Feature& a, const Feature& b, const Vector3& normal,
                     const GapShift& shift, double radius, bool has_caps, double deepest);

}  // namespace counterpoint::collision
