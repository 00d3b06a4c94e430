// How concave a mesh is, closed or not.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// The largest distance of a point of the hull's surface from the mesh [m]: the depth of the
/// hollows that the hull bridges. A point that far was found; none is farther by more than 2 % of
/// the hull's diameter, unless more than three thousand places had to be looked at. hull: the full
/// one.
double hull_standoff(const ConvexMesh& hull, const TriangleMesh& mesh);

}  // namespace counterpoint
