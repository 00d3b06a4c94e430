// Which geoms touch, and with what friction: contype, conaffinity, <exclude>, <pair>.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/document/switches.h"

namespace counterpoint::mjcf {

/// Gives the links their collisions and the world its environment; what may not touch is excluded;
/// pairs whose friction is not the geometric mean get theirs.
void read_contacts(Document& document, const Defaults& defaults, Assets& assets,
                   const Bodies& bodies, const Switches& switches, MjcfModel& model);

}  // namespace counterpoint::mjcf
