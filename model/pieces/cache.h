// Pieces of meshes, kept in files.
#pragma once

#include <filesystem>
#include <string>

#include "counterpoint/model/pieces/pieces.h"

namespace counterpoint {

/// Returns the folder with the files: $XDG_CACHE_HOME/counterpoint, or ~/.cache/counterpoint.
/// Empty, for none, without a home, or if the environment variable COUNTERPOINT_CACHE is "off".
std::filesystem::path cache_folder();

/// Returns convex_pieces(mesh, options, source), bit by bit, from a file in `folder` if there is
/// one for this mesh and these options; else leaves one there, if it can be written. A file that is
/// damaged, or of another version or processor, counts as none. Empty `folder`: no file.
/// @throws InputError as convex_pieces.
Pieces cached_pieces(const TriangleMesh& mesh, const MeshCollision& options,
                     const std::string& source, const std::filesystem::path& folder);

}  // namespace counterpoint
