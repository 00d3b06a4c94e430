// The nodes of a Collada file, which may instance one another.
#pragma once

#include "counterpoint/model/mesh/collada_reader.h"

namespace counterpoint {

/// Counts the nodes below <COLLADA> with all instances expanded. @throws InputError with file and
/// line for nodes within themselves, for more nodes than model/limits.h allows, and for instances
/// of missing nodes.
void check_collada_nodes(const tinyxml2::XMLElement& collada, const ColladaReader& reader);

}  // namespace counterpoint
