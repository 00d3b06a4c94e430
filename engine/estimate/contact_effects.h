// A scene reduced to its contacts and loop closures, all of which have constraint rows.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

/// Returns the contact effects that the model has: contacts with all their friction, and closures.
inline EffectSet contact_effects(const Model& model, const collision::Collider& collider) {
  EffectSet wanted;
  for (const Effect effect :
       {Effect::kContacts, Effect::kFriction, Effect::kStaticFriction, Effect::kFrictionDirections,
        Effect::kSurfaceMotion, Effect::kTorsionalFriction, Effect::kRollingFriction,
        Effect::kClosures})
    wanted.set(effect, true);
  return active_effects(called_for(model, collider), wanted);
}

/// Finds the constraints at (q, v) without parking any. Leaves poses, velocities and inertias at
/// (q, v) in `data`.
inline void find_all_constraints(const StepContext& at, ConstraintFinder& finder, Data& data,
                                 ConstraintSet& out) {
  compute_poses(at.model, at.q, data);
  compute_velocities(at.model, at.v, data);
  compute_inertias(at.model, data);
  EffectCounts not_counted;
  finder.find(at, data, out, not_counted);
  finder.contacts().unpark_all(at, data, out);
}

}  // namespace counterpoint::estimation
