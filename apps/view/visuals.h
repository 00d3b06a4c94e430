// Appearance of robots: the <visual> elements of their files, which the model omits.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::view {

/// A shape that is only shown, without collisions.
struct Visual {
  std::string name;  ///< name of its link
  int body = 0;
  int instance = 0;
  Pose X_BV;
  Shape shape;                                 ///< kConvexMesh without a hull for a mesh
  int mesh = -1;                               ///< index into Visuals::meshes
  std::optional<std::array<double, 4>> color;  ///< red, green, blue, opacity, each 0 ... 1
};

struct Visuals {
  std::vector<Visual> shapes;
  std::vector<TriangleMesh> meshes;  ///< vertices in [m], each file once per scale
  std::vector<int> instances;  ///< instances with visuals, whose collision shapes can be hidden
  /// Visuals that could not be shown, with the reason, and meshes that were simplified.
  std::vector<std::string> notes;
};

/// Limits on the number of triangles of one mesh and of all meshes of a scene; meshes above are
/// simplified.
inline constexpr std::size_t kMaxVisualTriangles = 20'000;
inline constexpr std::size_t kMaxAllVisualTriangles = 120'000;

/// Reads the visuals of every robot of a scene (.yaml) or of a single robot (.urdf) that was read
/// into `model`. Returns none if all of them coincide with collision shapes. Mesh files are
/// searched for and permitted as those of collision shapes (find_mesh); one that is missing or
/// unreadable becomes a note. packages: as in SceneOverrides. @throws InputError if the scene file
/// does not exist.
Visuals read_visuals(const std::filesystem::path& scene_file, const Model& model,
                     const std::map<std::string, std::filesystem::path>& packages);

/// Merges the vertices in each cell of a grid, the finest one that leaves at most `most` triangles.
void make_coarser(TriangleMesh& mesh, std::size_t most);

}  // namespace counterpoint::view
