// Shapes, surfaces and pairs of geometries in MJCF.
#pragma once

#include <set>
#include <string>
#include <utility>

#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Returns the attributes type and size; empty if MJCF has no such shape. @throws InputError for a
/// plane that is not fixed to the world.
std::pair<std::string, std::string> mjcf_shape(const Geometry& g);

/// Returns the values of a surface that act: those of effects that are on; without sliding friction
/// there is no torsional or rolling friction.
inline Material acting_surface(Material m, EffectSet on) {
  if (!on.has(Effect::kFriction)) m.friction = 0.0;
  if (!on.has(Effect::kFrictionDirections)) m = m.without_direction();
  if (!on.has(Effect::kStaticFriction)) m.static_friction = 0.0;
  if (!on.has(Effect::kSurfaceMotion)) m.surface_velocity.setZero();
  if (!on.has(Effect::kTorsionalFriction) || m.friction <= 0.0) m.torsional_friction = 0.0;
  if (!on.has(Effect::kRollingFriction) || m.friction <= 0.0) m.rolling_friction = 0.0;
  if (!on.has(Effect::kRestitution)) m.restitution = 0.0;
  if (!on.has(Effect::kStiffness)) {
    m.stiffness = std::numeric_limits<double>::infinity();
    m.per_area = Spring();
  }
  return m;
}

/// Returns the attribute condim: the number of directions in which a contact acts.
inline const char* mjcf_dimensions(const Material& m) {
  if (m.rolling_friction > 0.0) return "6";
  if (m.torsional_friction > 0.0) return "4";
  return m.friction > 0.0 ? "3" : "1";
}

/// Returns the closures that MJCF has as equalities, rigid balls, welds and distances, and hinges
/// as balls at two points of their axis; those in place hold the pose at the start. Adds the
/// others, and loads at which one breaks, to `lost`.
std::vector<Closure> mjcf_closures(const Model& model, std::vector<Note>& lost);

using IndexPairs = std::set<std::pair<int, int>>;  ///< the lower index first

/// Contents of <contact>.
struct MjcfPairs {
  IndexPairs excluded_bodies;  ///< their geometries do not collide, except listed pairs
  IndexPairs listed;           ///< pairs of geometries
};

/// Returns what makes the geometries collide that may touch, all pairs except `apart`. MuJoCo
/// leaves out pairs of one body, and of parent and child unless the parent is the world. Bodies of
/// which some geometries must not touch are excluded, and their remaining pairs are listed. `all`:
/// lists all pairs.
MjcfPairs list_mjcf_pairs(const Model& model, const IndexPairs& apart, bool all);

}  // namespace counterpoint
