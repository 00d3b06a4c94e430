// Collision pairs and their friction: contype, conaffinity, <exclude>, <pair>.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/document/switches.h"

namespace counterpoint::mjcf {

/// Adds the collision geometries of the links and the environment. Excludes the pairs that do not
/// collide, and sets the friction of pairs where it is not the geometric mean.
void read_contacts(Document& document, const Defaults& defaults, Assets& assets,
                   const Bodies& bodies, const Switches& switches, MjcfModel& model);

}  // namespace counterpoint::mjcf
