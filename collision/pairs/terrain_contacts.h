// Contact points of a convex shape with a static triangle mesh.
//
// A corner of the shape touches the face below it, along the face's normal; an edge or corner of
// the mesh touches the shape only where the surface bends away (or ends), along a normal between
// those of its faces. So a body never catches on the seams of flat or hollow ground, and the
// contacts of a body on flat triangles are those with a plane.
#pragma once

#include <vector>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/collision/shapes/enclosure.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Scratch memory inside: one per thread. The result does not depend on the calls before.
class TerrainContacts {
 public:
  /// Fills `out` with at most Manifold::kCapacity contact points of gap < margin [m], normals from
  /// the terrain to the shape (no plane, no terrain). Where there are more the deepest is kept and
  /// those that span place and direction. A shape behind a face by more than half its thickness
  /// does not meet it. Parameters: shapes, poses and bounds of two.
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
