// Contact points of a convex shape with a static triangle mesh.
//
// A corner of the shape touches the face below it, along the face's normal. An edge or corner of
// the mesh touches the shape only if the surface is convex there (or ends), along a normal between
// those of its faces. Therefore a body never catches on the seams of flat or concave ground, and
// the contacts of a body on flat triangles are those with a plane.
#pragma once

#include <vector>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/collision/shapes/enclosure.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Finds the contacts. It owns scratch memory, so use one per thread; the result does not depend on
/// earlier calls.
class TerrainContacts {
 public:
  /// Fills `out` with at most Manifold::kCapacity contact points of gap < margin [m], normals from
  /// the terrain to the shape (no plane, no terrain). If there are more, it keeps the deepest and
  /// others that differ most in position and normal. A shape whose centre is behind a face by more
  /// than half its half thickness touches the face only with corners that reach over it from beyond
  /// its edges. A point deeper than 5 % of the half thickness counts only behind the surface
  /// (is_behind): inside a solid, or under the ground.
  void find(const Terrain& terrain, const Pose& X_WT, const Shape& shape,
            const Enclosure& enclosure, const Pose& X_WS, double margin, Manifold& out);

 private:
  struct Query;
  void touch_faces(const Query& query, int triangle);
  void touch_edges(const Query& query, int triangle);
  void touch_fin(const Query& query, const Vector3& middle, const Vector3& along,
                 double half_length, const Vector3& up);
  void add(const Query& query, const ContactPoint& point);
  void choose(const Query& query, Manifold& out) const;

  std::vector<int> triangles_;
  std::vector<ContactPoint> points_;  // in the terrain's frame
};

}  // namespace counterpoint::collision
