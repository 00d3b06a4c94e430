#include "mjcf.h"

#include <algorithm>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/model/robot_files.h"
#include "not_expressible.h"

namespace counterpoint::peers {
namespace {

void refuse_what_mujoco_lacks(const Model& model, EffectSet called, EffectSet on) {
  if (called.has(Effect::kCoriolis) && !on.has(Effect::kCoriolis))
    throw NotExpressible("MuJoCo always has Coriolis forces");
  if (on.has(Effect::kRestitution)) throw NotExpressible("MuJoCo has no restitution");
  if (on.has(Effect::kVelocityLimits)) throw NotExpressible("MuJoCo has no velocity limits");
  for (const Geometry& g : model.geometries()) {
    if (g.shape.type == ShapeType::kTerrain)
      throw NotExpressible("MuJoCo has no terrain of triangles");
    if (g.shape.type == ShapeType::kPlane && g.body != 0)
      throw NotExpressible("MuJoCo has planes on the world only");
  }
  for (const GravityCompensation& part : model.gravity_compensations()) {
    if (!carried_weight(model, part.body).at_center)
      throw NotExpressible("MuJoCo carries a share of a body's weight at its centre of mass only");
  }
  for (const Closure& c : model.closures()) {
    const bool known = c.type == ClosureType::kBall || c.type == ClosureType::kWeld ||
                       c.type == ClosureType::kDistance;
    const bool plain = known && !c.rope && !c.switched && !c.linear.acts && !c.angular.acts;
    if (on.has(Effect::kClosures) && !plain)
      throw NotExpressible("MuJoCo has rigid balls, welds and distances only, no closure like '" +
                           c.name + "'");
  }
  if (on.has(Effect::kPrescribed))
    throw NotExpressible("prescribed motion is not written for MuJoCo");
  if (on.has(Effect::kTendons)) throw NotExpressible("tendons are not played in MuJoCo");
  if (on.has(Effect::kActuators)) throw NotExpressible("actuators are not played in MuJoCo");
  if (!on.has(Effect::kDrag)) return;
  for (const BodyDrag& drag : model.drags()) {
    if (!is_free(model.body(drag.body)) || drag.drag.quadratic > 0.0 ||
        drag.drag.angular_quadratic > 0.0 || !drag.center.isZero())
      throw NotExpressible("MuJoCo has no such drag; only linear drag of free bodies is the same");
  }
}

/// Pairs of geometries that never touch, except those of one body and of parent and child, which
/// MuJoCo leaves out itself unless the parent is the world.
std::vector<std::pair<int, int>> pairs_apart(const Model& model,
                                             const collision::Collider& collider) {
  std::vector<std::pair<int, int>> out;
  const auto& g = model.geometries();
  const int n = static_cast<int>(g.size());
  for (int a = 0; a < n; ++a) {
    for (int b = a + 1; b < n; ++b) {
      const auto [i, j] = std::minmax(g[a].body, g[b].body);
      const bool joined = i > 0 && model.body(j).parent == i;
      if (i != j && !joined && !collider.may_touch(a, b)) out.emplace_back(a, b);
    }
  }
  return out;
}

}  // namespace

bool is_free(const Body& body) {
  return body.joint_type == JointType::kFloating && body.parent == 0;
}

EffectSet effects_of(const Scene& scene) {
  return active_effects(called_for(scene.model, collision::Collider(scene.model)),
                        scene.options.effects);
}

std::string mjcf(const Scene& scene) {
  const collision::Collider collider(scene.model);
  const EffectSet called = called_for(scene.model, collider);
  const EffectSet on = active_effects(called, scene.options.effects);
  refuse_what_mujoco_lacks(scene.model, called, on);
  MjcfExport how;
  how.apart = pairs_apart(scene.model, collider);
  how.effects = on.without({Effect::kEffortLimits});
  how.integrator = "Euler";
  how.start = how.frames = false;
  how.pair_surfaces = true;
  return export_mjcf(scene, how).text;
}

}  // namespace counterpoint::peers
