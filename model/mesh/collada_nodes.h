// The nodes of a Collada file, which may instance one another.
#pragma once

#include "counterpoint/model/mesh/collada_reader.h"

namespace counterpoint {

/// Counts the nodes below <COLLADA>, those of instances wherever they stand. @throws InputError
/// with file and line for nodes that stand within themselves, or come to more than model/limits.h
/// takes, and for instances of nodes that are not there.
void check_collada_nodes(const tinyxml2::XMLElement& collada, const ColladaReader& reader);

}  // namespace counterpoint
