// Fewer triangles where there are very many. Private to pieces.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint::pieces {

struct ThinnedMesh {
  TriangleMesh mesh;
  double moved = 0.0;  ///< largest distance by which a vertex moved [m]
};

/// Returns a mesh of at most 10,000 triangles: if it has more, vertices in the same cell of a grid
/// become one, their mean, and triangles without three vertices or equal to others go (vertex
/// clustering: Rossignac and Borrel 1993). The cells are as small as that allows.
ThinnedMesh thinned(const TriangleMesh& mesh);

/// Returns a mesh of fewer triangles, of those vertices that are left when edges collapse up to an
/// error [m] by quadrics (Garland and Heckbert 1997); the same mesh if it has at most 600 triangles
/// or nothing would be left. Vertices are rounded to floats to decide.
TriangleMesh simplified(const TriangleMesh& mesh, double error);

}  // namespace counterpoint::pieces
