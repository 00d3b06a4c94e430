// The solids of a Collada file, written anew without anything else.
#pragma once

#include <filesystem>
#include <string>

namespace counterpoint {

/// The text of a Collada document with the unit, the up axis, the nodes and the meshes of a file,
/// each mesh as polygons of positions. Assimp's reader trusts what it reads: it crashes, or reads
/// without end, where numbers are none, point beyond their arrays or stand in another order. Of a
/// file of unknown origin it is given this. Normals, colours, lines, materials, lights, animations
/// and the like are not looked at. @throws InputError with file and line for XML that is not
/// well-formed, lists that are not of numbers or not of the length they should have, references to
/// nothing, indices out of range, nodes beyond model/limits.h, and for solids that are not read:
/// skins, convex_mesh, brep, skew, polygons with holes.
std::string plain_collada(const std::filesystem::path& file);

}  // namespace counterpoint
