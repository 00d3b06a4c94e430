// Impacts of which only the velocities before and after are known: what the contact law makes of
// the former at once, without time or forces in between.
#pragma once

#include <memory>

#include "counterpoint/model/scene.h"

namespace counterpoint::apps {

struct Impact {
  VectorX v;                   ///< after [m/s, rad/s]
  int contacts = 0;            ///< within reach; none: nothing changes
  double energy_before = 0.0;  ///< kinetic [J]
  double energy = 0.0;         ///< after
};

/// The scene's contacts, closures, friction and restitution on velocities. Of each pair of
/// geometries nearer than the scene's margin the nearest point counts, as touching, whatever its
/// gap: recorded poses are not exact to where surfaces meet.
class ImpactSolver {
 public:
  explicit ImpactSolver(const Scene& scene);
  ~ImpactSolver();

  /// Valid until the next call. @throws std::runtime_error where the solver fails.
  const Impact& solve(const VectorX& q, const VectorX& v);

  /// A difference of velocities at the pose solved last as L' d / sqrt(mass), M = L L' [m/s]: its
  /// length is the speed at which all that moves has the kinetic energy of the difference.
  VectorX weighted(const VectorX& difference) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::apps
