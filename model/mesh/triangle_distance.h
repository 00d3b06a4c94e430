// Distance of a point from a triangle [m].
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Returns the point of a triangle nearest to p [m]. A triangle without area counts as its edges.
/// (Ericson, "Real-time collision detection", 2005, 5.1.5.)
inline Vector3 nearest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b,
                                   const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const Vector3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const Vector3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) return a + d1 / (d1 - d3) * ab;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + (d5 - d6)) * (c - b);
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

inline double distance_to_triangle(const Vector3& p, const Vector3& a, const Vector3& b,
                                   const Vector3& c) {
  return (p - nearest_on_triangle(p, a, b, c)).norm();
}

}  // namespace counterpoint
