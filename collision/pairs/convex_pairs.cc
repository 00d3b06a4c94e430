// Any two convex shapes: closest points by iteration, contact points from the features around them.
#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/convex/gjk.h"
#include "counterpoint/collision/pairs/pair_functions.h"

namespace counterpoint::collision {

void convex_convex(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  Witness witness;
  if (!closest_points(a, X_WA, b, X_WB, margin, witness)) return;
  Feature feature_a;
  Feature feature_b;
  support_feature(a, X_WA, witness.normal, witness.vertex_a, feature_a);
  support_feature(b, X_WB, -witness.normal, witness.vertex_b, feature_b);
  const double size = (X_WB.translation - X_WA.translation).norm() + std::abs(witness.distance);
  constexpr double kSame = 1e-10;  // relative to size: 1000 times the error of the distance
  feature_contacts(feature_a, feature_b, witness, kSame * size, margin, out);
}

}  // namespace counterpoint::collision
