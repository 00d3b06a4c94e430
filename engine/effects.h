// Which effects a scene calls for, and why: determined once; a step runs these and no others.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// The effects that something in the model calls for: damping where a joint has some, contacts
/// where a pair of geometries may touch, and so on. What an input calls for (applied forces,
/// wrenches) is in.
EffectSet called_for(const Model& model, const collision::Collider& collider);

/// Those of `called` that `switches` leaves on. Without contacts there is no friction, and so on.
EffectSet active_effects(EffectSet called, EffectSet switches);

/// One line of the table of effects.
struct EffectUse {
  Effect effect = Effect::kGravity;
  bool called_for = false;  ///< something in the scene asks for it
  bool on = false;          ///< called for and not switched off: it is run
  std::string why;          ///< what calls for it; or who switched it off
  int rows = 0;  ///< rows of the contact problem it can add; of contacts: at each contact point
};

/// All effects, in the order of the enumeration. For reading; it allocates.
std::vector<EffectUse> list_effects(const Model& model, const collision::Collider& collider,
                                    const SimulationOptions& options);

}  // namespace counterpoint
