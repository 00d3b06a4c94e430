// A measure of how concave a mesh is, closed or not.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// The largest distance from a point on the hull's surface to the mesh [m]: the depth of the
/// hollows that the hull bridges. The value is attained at some point; the true maximum is larger
/// by at most 2 % of the hull's diameter, unless the search stops after 3000 points. `hull`: the
/// full hull.
double hull_standoff(const ConvexMesh& hull, const TriangleMesh& mesh);

}  // namespace counterpoint
