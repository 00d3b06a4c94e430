#include "counterpoint/engine/effects.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/engine/step.h"

namespace counterpoint {
namespace {

/// Elements of one kind in a scene: their number, and the name of the first.
struct Found {
  int count = 0;
  std::string first;

  void add(const std::string& name) {
    if (count++ == 0) first = name;
  }
  std::string text(const char* what) const {
    if (count == 0) return fmt::format("no {}", what);
    return count == 1 ? fmt::format("{}: {}", what, first)
                      : fmt::format("{}: {} and {} more", what, first, count - 1);
  }
};

/// Returns the joints with a positive entry in `values` (nv).
Found joints_with(const Model& model, const VectorX& values) {
  Found found;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const auto of_joint = values.segment(body.v_index, joint_nv(body.joint_type));
    if ((of_joint.array() > 0.0).any()) found.add(model.joint(i - 1).name);
  }
  return found;
}

template <class Property>
Found joints_that(const Model& model, Property has) {
  Found found;
  for (const JointInfo& joint : model.joints())
    if (has(joint)) found.add(joint.name);
  return found;
}

template <class Property>
Found geometries_that(const Model& model, Property has) {
  Found found;
  for (const Geometry& g : model.geometries())
    if (has(g.material)) found.add(g.name);
  for (const PairMaterial& p : model.pair_materials())
    if (has(p.material)) found.add(model.geometries()[p.geometry_a].name);
  return found;
}

/// Returns the geometries with the friction `have` and sliding friction, without which it has no
/// effect.
Found rubbing_geometries_that(const Model& model, double Material::*have) {
  return geometries_that(model,
                         [=](const Material& m) { return m.*have > 0.0 && m.friction > 0.0; });
}

/// Returns the bodies with velocity-dependent forces.
Found turning_bodies(const Model& model) {
  Found found;
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.body(i).joint_type != JointType::kPrismatic) found.add(model.joint(i - 1).link);
  return found;
}

/// Returns the number of limits of a joint.
int num_limits(const JointInfo& joint) {
  return static_cast<int>(std::isfinite(joint.lower)) +
         static_cast<int>(std::isfinite(joint.upper));
}

/// Returns ", compensated links: ..." or an empty string.
std::string carried_weight(const Model& model) {
  Found found;
  for (const GravityCompensation& carried : model.gravity_compensations())
    found.add(model.joint(carried.body - 1).link);
  return found.count == 0 ? "" : found.text(", compensated links");
}

/// Returns the largest number of rows of a tendon (engine/forces/tendons.h).
int num_rows(const Tendon& tendon) {
  const bool slack = tendon.stiffness > 0.0 && tendon.rest_shortest < tendon.rest_longest;
  const bool passive = tendon.damping > 0.0 || (tendon.stiffness > 0.0 && !slack);
  return static_cast<int>(passive) + 2 * static_cast<int>(slack) +
         static_cast<int>(tendon.dry_friction > 0.0) +
         static_cast<int>(std::isfinite(tendon.lower)) +
         static_cast<int>(std::isfinite(tendon.upper)) + 1;  // servo or input
}

struct Call {
  bool called = false;
  std::string why;
  int rows = 0;
};

Call call(const Found& found, const char* what, int rows = 0) {
  return {found.count > 0, found.text(what), rows};
}

int closure_rows(const Model& model) {
  int rows = 0;
  for (const Closure& closure : model.closures()) rows += num_rows(closure);
  return rows;
}

// Long: one case per effect, so that the compiler reports a missing one.
Call call_of(Effect effect, const Model& model, const collision::Collider& collider) {
  const auto joints = [&](const VectorX& values, int rows_each = 0) {
    const Found found = joints_with(model, values);
    return call(found, "joints", rows_each * found.count);
  };
  switch (effect) {
    case Effect::kGravity:
      return {!model.gravity().isZero(0.0) && model.num_bodies() > 1,
              fmt::format("gravity {:.6g} m/s^2", model.gravity().norm()) + carried_weight(model),
              0};
    case Effect::kCoriolis:
      return call(turning_bodies(model), "links that turn");
    case Effect::kArmature:
      return joints(model.armature());
    case Effect::kDamping:
      return joints(model.damping());
    case Effect::kDryFriction: {
      const VectorX most = model.dry_friction().cwiseMax(model.breakaway_friction());
      Call found = joints(most);
      found.rows = static_cast<int>((most.array() > 0.0).count());
      return found;
    }
    case Effect::kBreakawayFriction:
      return joints((model.breakaway_friction() - model.dry_friction()).cwiseMax(0.0));
    case Effect::kLimits: {
      int rows = 0;
      for (const JointInfo& joint : model.joints()) rows += num_limits(joint);
      return call(joints_that(model, [](const JointInfo& j) { return num_limits(j) > 0; }),
                  "joints", rows);
    }
    case Effect::kMimics: {
      Found found;
      for (const Mimic& mimic : model.mimics()) found.add(model.joint(mimic.joint).name);
      return call(found, "joints", found.count);
    }
    case Effect::kTendons: {
      Found found;
      int rows = 0;
      for (const Tendon& tendon : model.tendons()) {
        found.add(tendon.name);
        rows += num_rows(tendon);
      }
      return call(found, "tendons", rows);
    }
    case Effect::kActuators: {
      Found found;
      int rows = 0;
      for (const Actuator& actuator : model.actuators()) {
        found.add(actuator.name);
        rows += actuator.transmission == Transmission::kJoint ||
                actuator.transmission == Transmission::kTendon;
      }
      return call(found, "actuators", rows);
    }
    case Effect::kPrescribed:
      return call(joints_that(model, [](const JointInfo& j) { return j.prescribed; }), "joints");
    case Effect::kClosures: {
      Found found;
      for (const Closure& closure : model.closures()) found.add(closure.name);
      return call(found, "closures", closure_rows(model));
    }
    case Effect::kContacts:
      return {collider.num_enabled_pairs() > 0,
              fmt::format("{} pairs of geometries may touch", collider.num_enabled_pairs()), 1};
    case Effect::kFriction:
      return call(geometries_that(model, [](const Material& m) { return m.friction > 0.0; }),
                  "geometries", 2);
    case Effect::kStaticFriction:
      return call(geometries_that(
                      model, [](const Material& m) { return m.friction_at_rest() > m.friction; }),
                  "geometries with friction");
    case Effect::kFrictionDirections:
      return call(geometries_that(model, [](const Material& m) { return m.is_directional(); }),
                  "geometries with friction");
    case Effect::kSurfaceMotion:
      return call(
          geometries_that(model, [](const Material& m) { return !m.surface_velocity.isZero(0.0); }),
          "geometries with friction");
    case Effect::kTorsionalFriction:
      return call(rubbing_geometries_that(model, &Material::torsional_friction),
                  "geometries with friction", 1);
    case Effect::kRollingFriction:
      return call(rubbing_geometries_that(model, &Material::rolling_friction),
                  "geometries with friction", 3);
    case Effect::kRestitution:
      return call(geometries_that(model, [](const Material& m) { return m.restitution > 0.0; }),
                  "geometries");
    case Effect::kStiffness:
      return call(geometries_that(model, [](const Material& m) { return m.is_soft(); }),
                  "geometries");
    case Effect::kTautLinks: {
      Found found;
      for (const int body : list_pulled_links(model)) found.add(model.joint(body - 1).link);
      return call(found, "light links that may be pulled");
    }
    case Effect::kAppliedForces:
    case Effect::kExternalWrenches:
      return {true, "the input of a step, where it has some", 0};
    case Effect::kSleeping:
      return {collider.num_enabled_pairs() > 0, "bodies that may come to rest on others", 0};
    case Effect::kDrag: {
      Found found;
      for (const BodyDrag& drag : model.drags()) found.add(model.joint(drag.body - 1).link);
      return call(found, "links");
    }
    case Effect::kSprings: {
      Found found;
      for (const JointSpring& spring : model.springs()) found.add(model.joint(spring.joint).name);
      return call(found, "joints");
    }
    case Effect::kServos: {
      Found found;
      int rows = 0;
      for (const JointServo& servo : model.servos()) {
        found.add(model.joint(servo.joint).name);
        rows += std::isfinite(model.joint(servo.joint).effort_limit);
      }
      return call(found, "joints", rows);
    }
    case Effect::kEffortLimits:
      return call(joints_that(model,
                              [](const JointInfo& j) {
                                return j.actuated && std::isfinite(j.effort_limit);
                              }),
                  "joints");
    case Effect::kVelocityLimits: {
      Found found;
      int rows = 0;
      for (int i = 0; i < model.num_joints(); ++i) {
        if (!std::isfinite(model.joint(i).velocity_limit)) continue;
        found.add(model.joint(i).name);
        rows += joint_nv(model.body(i + 1).joint_type);
      }
      return call(found, "joints", rows);
    }
  }
  return {false, "nothing", 0};
}

constexpr std::initializer_list<Effect> kOfContacts = {
    Effect::kFriction,      Effect::kStaticFriction,    Effect::kFrictionDirections,
    Effect::kSurfaceMotion, Effect::kTorsionalFriction, Effect::kRollingFriction,
    Effect::kRestitution,   Effect::kStiffness,         Effect::kSleeping};

}  // namespace

EffectSet called_for(const Model& model, const collision::Collider& collider) {
  EffectSet called;
  for (int i = 0; i < kNumEffects; ++i) {
    const auto effect = static_cast<Effect>(i);
    called.set(effect, call_of(effect, model, collider).called);
  }
  return called;
}

EffectSet active_effects(EffectSet called, EffectSet switches) {
  const EffectSet active = called & switches;
  return active.has(Effect::kContacts) ? active : active.without(kOfContacts);
}

std::vector<EffectUse> list_effects(const Model& model, const collision::Collider& collider,
                                    const SimulationOptions& options) {
  const EffectSet active = active_effects(called_for(model, collider), options.effects);
  std::vector<EffectUse> list;
  for (int i = 0; i < kNumEffects; ++i) {
    const auto effect = static_cast<Effect>(i);
    const Call call = call_of(effect, model, collider);
    EffectUse use{effect, call.called, active.has(effect), call.why, call.called ? call.rows : 0};
    if (call.called && !use.on)
      use.why += options.effects.has(effect) ? " (contacts are off)" : " (switched off)";
    list.push_back(std::move(use));
  }
  return list;
}

}  // namespace counterpoint
