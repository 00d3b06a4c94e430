// Reduces a Collada file to its solids.
#pragma once

#include <filesystem>
#include <string>

namespace counterpoint {

/// The text of a Collada document with the unit, up axis, nodes and meshes of a file, each mesh as
/// polygons of positions. Assimp does not check its input: it crashes, or reads without end, at
/// malformed numbers, indices out of range or elements in another order. It gets this text instead
/// of a file of unknown origin. Normals, colours, lines, materials, lights, animations and the like
/// are ignored. @throws InputError with file and line for malformed XML, for lists that are not
/// numeric or have the wrong length, references to missing elements, indices out of range, more
/// nodes than model/limits.h allows, and for solids that are not supported: skins, convex_mesh,
/// brep, skew, polygons with holes.
std::string plain_collada(const std::filesystem::path& file);

}  // namespace counterpoint
