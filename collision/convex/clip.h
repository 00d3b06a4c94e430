// Polygons in the frame of a contact normal, and their common part.
#pragma once

#include <array>

#include "counterpoint/collision/convex/feature.h"

namespace counterpoint::collision {

inline constexpr int kMaxPatch = 2 * Feature::kCapacity;  // each edge of a window can add a corner

/// A polygon in the frame of the contact normal: z is the height along it.
struct Patch {
  std::array<Vector3, kMaxPatch> points;
  int size = 0;
};

/// The plane of a feature as a height along n: z = offset + slope . (x, y).
struct HeightField {
  double offset, slope_x, slope_y;
  double at(const Vector3& p) const { return offset + slope_x * p.x() + slope_y * p.y(); }
};

inline Vector3 to_frame(const Matrix3& frame, const Vector3& p) { return frame.transpose() * p; }

inline HeightField height_field(const Matrix3& frame, const Feature& f) {
  const Vector3 normal = to_frame(frame, f.normal);
  const double offset = f.normal.dot(f.vertices[0]);
  return {offset / normal.z(), -normal.x() / normal.z(), -normal.y() / normal.z()};
}

/// Clips `subject` (polygon or segment) to the polygon `window`, both projected along the normal,
/// the last column of `frame`. Points within `tolerance` [m] of an edge stay.
void clip_to_polygon(const Matrix3& frame, const Feature& subject, const Feature& window,
                     double tolerance, Patch& out);

/// True if a polygon can be clipped against: neither edge-on nor with an edge shorter than
/// `tolerance` [m].
bool faces(const Feature& f, const Vector3& direction, double tolerance);

}  // namespace counterpoint::collision
