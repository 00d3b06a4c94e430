// The effects that a scene calls for, and the reasons. They are determined once; a step runs these
// and no others.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Returns the effects that something in the model calls for: damping where a joint has some,
/// contacts where a pair of geometries may touch, and so on. Effects of an input (applied forces,
/// wrenches) are always included.
EffectSet called_for(const Model& model, const collision::Collider& collider);

/// Returns the effects of `called` that `switches` leaves on. Effects that depend on another one go
/// with it: without contacts there is no friction.
EffectSet active_effects(EffectSet called, EffectSet switches);

/// Returns the bodies, ascending, whose links may become taut (taut_links.h): closures or joints
/// may pull them, and they are light beside the masses that may hang on them.
std::vector<int> list_pulled_links(const Model& model);

/// One line of the table of effects.
struct EffectUse {
  Effect effect = Effect::kGravity;
  bool called_for = false;  ///< something in the scene asks for it
  bool on = false;          ///< called for and not switched off: steps run it
  std::string why;          ///< the reason: the element that calls for it, or the switch
  int rows = 0;  ///< rows of the contact problem that it can add; for contacts: per contact point
};

/// Lists all effects in the order of the enumeration. It allocates.
std::vector<EffectUse> list_effects(const Model& model, const collision::Collider& collider,
                                    const SimulationOptions& options);

}  // namespace counterpoint
