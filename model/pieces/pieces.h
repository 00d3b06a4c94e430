// Convex pieces whose union stands for a body that is not convex.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

struct Pieces {
  std::vector<std::shared_ptr<const ConvexMesh>> pieces;  ///< at least one
  double tolerance = 0.0;                                 ///< the tolerance used [m]
  /// Largest distance from the surface of the union to the solid, measured to a tenth of the
  /// tolerance [m].
  double outside = 0.0;
  /// Largest distance from a corner, an edge's middle or a centroid of the mesh to the union [m]; 0
  /// where the union covers the solid.
  double inside = 0.0;
  /// Why the hull is the only piece although it stands off farther than the tolerance; else "".
  std::string reason;
};

/// Returns convex pieces whose union is the solid within the mesh, to the tolerance where the
/// number of pieces allows: while the hull of a part has points farther from the solid than the
/// tolerance, the part is cut by the plane, through a concave edge or the point nearest to such a
/// point, that leaves the fewest of them in hulls, then the least volume (Mamou and Ghorbel 2009);
/// then pieces are joined while within the tolerance. Holes narrower than twice the tolerance may
/// be filled, and hollows that are closed, or open by such holes alone, are: they count as solid.
///
/// The result is a pure function of its arguments; moving, turning or scaling mesh and tolerance
/// changes it by rounding, for meshes of more than 600 triangles by a part of the tolerance, since
/// a simpler mesh is cut (simplified). Number of pieces, memory and operations are bounded for
/// every mesh: when the operations are used up, parts stay as they are, and `outside` and `inside`
/// are larger than the tolerance. In a mesh of more than 10,000 triangles, vertices close together
/// become one first. A mesh that is not closed is solid where it winds more than half around a
/// point (WindingNumber).
/// @throws InputError (with `source`) where make_convex_hull of the mesh does, or for a tolerance
/// or number out of range.
Pieces convex_pieces(const TriangleMesh& mesh, const MeshCollision& options,
                     const std::string& source = "");

/// Gives the hull of a mesh its pieces and union_standoff, or hull_reason where the hull does as
/// well; with MeshKind::kAuto also where pieces stand off more than half as far as the hull.
void add_pieces(const TriangleMesh& mesh, const MeshCollision& collision, ConvexMesh& hull);

}  // namespace counterpoint
