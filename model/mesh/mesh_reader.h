// The reader of mesh files, a module (files/module.h).
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// Reads the triangles of all nodes as they stand in the file [m], z up: not scaled, nor welded.
/// @throws InputError as load_mesh.
TriangleMesh read_mesh(const std::filesystem::path& file, bool collada, PolygonSplit split);

struct MeshReader {
  decltype(&read_mesh) read;
};

}  // namespace counterpoint
