// A scene reduced to its contacts and closures.
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

/// Of the effects that the model calls for: contacts with all their friction, and closures.
inline EffectSet contact_effects(const Model& model, const collision::Collider& collider) {
  EffectSet wanted;
  for (const Effect effect : {Effect::kContacts, Effect::kFriction, Effect::kTorsionalFriction,
                              Effect::kRollingFriction, Effect::kClosures})
    wanted.set(effect, true);
  return active_effects(called_for(model, collider), wanted);
}

}  // namespace counterpoint::estimation
