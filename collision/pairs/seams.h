// Contacts that the pieces of one mesh hide from each other.
//
// Where two pieces meet, the edge of one is no edge of the body. A contact on the surface of a
// piece is one of the body only if no other piece rises beyond it along the normal, unless the
// touching face or edge leads away from that piece and the space before it is free.
// Therefore a body never catches on a seam between pieces (compare terrain_contacts.h).
#pragma once

#include <cstddef>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Knows which pieces of a mesh are neighbours.
class Seams {
 public:
  explicit Seams(const std::vector<Geometry>& geometries);

  bool is_piece(int geometry) const { return !neighbors_[geometry].empty(); }
  /// True if a contact at p [m] with the outward unit normal n, both in the geometry's frame, is
  /// inside the body or at a seam. p lies on the surface of the geometry, a piece.
  bool hides(int geometry, const Vector3& p, const Vector3& n) const;
  /// True if another piece is within the reach [m] of p.
  bool is_near(int geometry, const Vector3& p, double reach) const;

 private:
  // A piece that may hide contacts of another one.
  struct Neighbor {
    const ConvexMesh* mesh;
    Vector3 center;
    double reach_square;  // squared distance from `center` beyond which it hides nothing [m^2]
    // Depth from which on a face is covered, distance at which surfaces meet at a seam, and
    // accuracy of corners [m].
    double deep, seam, rounding;
    std::size_t facing;  // its face towards the piece: the first to be tested
  };
  std::vector<const ConvexMesh*> meshes_;  // a mesh or null for each geometry
  std::vector<std::vector<Neighbor>> neighbors_;
};

}  // namespace counterpoint::collision
