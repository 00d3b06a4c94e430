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

}  // namespace counterpoint::pieces
