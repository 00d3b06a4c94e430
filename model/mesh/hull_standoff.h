// A measure of how concave a mesh is, closed or not.
#pragma once

#include <functional>
#include <limits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/nearest_triangle.h"

namespace counterpoint {

/// The largest distance from a point on the hull's surface to the mesh [m]: the depth of the
/// hollows that the hull bridges. The value is attained at some point; the true maximum is larger
/// by at most 2 % of the hull's diameter, unless the search stops after 3000 points. `hull`: the
/// full hull.
double hull_standoff(const ConvexMesh& hull, const TriangleMesh& mesh);

/// The same for the hull of a part of a solid, whose surface is the mesh: the largest distance from
/// a point on the hull's surface to the solid.
struct PartStandoff {
  const NearestTriangle& mesh;
  /// Radius of a ball about a point that is within the solid [m], negative outside of it; the
  /// second argument is the point's distance from the mesh. Null: no point is inside.
  std::function<double(const Vector3&, double)> depth;
  double tolerance;  ///< the true maximum is larger by at most this [m]
  double enough = std::numeric_limits<double>::infinity();  ///< stops at a larger distance [m]
  double known = 0.0;  ///< smaller distances do not matter [m]; returned if there is no larger one
  int most = 3'000;    ///< points after which the search stops
};
struct FarthestPoint {
  double distance = 0.0;            ///< [m]
  Vector3 point = Vector3::Zero();  ///< undefined if the distance is `known`
};
/// `hull`: of a set of points of the solid.
FarthestPoint hull_standoff(const ConvexMesh& hull, const PartStandoff& part);

}  // namespace counterpoint
