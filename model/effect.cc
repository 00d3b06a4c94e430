#include "counterpoint/model/scene.h"

namespace counterpoint {

// Long: one case per effect, so that the compiler reports a missing one.
const char* effect_name(Effect effect) {
  switch (effect) {
    case Effect::kGravity:
      return "gravity";
    case Effect::kCoriolis:
      return "coriolis";
    case Effect::kDrag:
      return "drag";
    case Effect::kArmature:
      return "armature";
    case Effect::kDamping:
      return "damping";
    case Effect::kSprings:
      return "springs";
    case Effect::kServos:
      return "servos";
    case Effect::kDryFriction:
      return "dry_friction";
    case Effect::kBreakawayFriction:
      return "breakaway_friction";
    case Effect::kLimits:
      return "limits";
    case Effect::kEffortLimits:
      return "effort_limits";
    case Effect::kVelocityLimits:
      return "velocity_limits";
    case Effect::kMimics:
      return "mimics";
    case Effect::kTendons:
      return "tendons";
    case Effect::kActuators:
      return "actuators";
    case Effect::kClosures:
      return "closures";
    case Effect::kContacts:
      return "contacts";
    case Effect::kFriction:
      return "friction";
    case Effect::kStaticFriction:
      return "static_friction";
    case Effect::kFrictionDirections:
      return "friction_directions";
    case Effect::kSurfaceMotion:
      return "surface_motion";
    case Effect::kTorsionalFriction:
      return "torsional_friction";
    case Effect::kRollingFriction:
      return "rolling_friction";
    case Effect::kRestitution:
      return "restitution";
    case Effect::kStiffness:
      return "stiffness";
    case Effect::kPrescribed:
      return "prescribed_motion";
    case Effect::kTautLinks:
      return "taut_links";
    case Effect::kAppliedForces:
      return "applied_forces";
    case Effect::kExternalWrenches:
      return "external_wrenches";
    case Effect::kSleeping:
      return "sleeping";
  }
  return "unknown";
}

std::optional<Effect> effect_from_name(const std::string& name) {
  for (int i = 0; i < kNumEffects; ++i)
    if (name == effect_name(static_cast<Effect>(i))) return static_cast<Effect>(i);
  return {};
}

std::string effect_names() {
  std::string names;
  for (int i = 0; i < kNumEffects; ++i)
    names += (i > 0 ? ", " : "") + std::string(effect_name(static_cast<Effect>(i)));
  return names;
}

}  // namespace counterpoint
