// What robots look like: the <visual> elements of their files, which the model leaves out.
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

/// A shape to look at.
struct Visual {
  std::string name;  ///< of its link
  int body = 0;
  int instance = 0;
  Pose X_BV;
  Shape shape;                                 ///< of a mesh: kConvexMesh without a hull
  int mesh = -1;                               ///< index into Visuals::meshes
  std::optional<std::array<double, 4>> color;  ///< red, green, blue, opacity, 0 ... 1
};

struct Visuals {
  std::vector<Visual> shapes;
  std::vector<TriangleMesh> meshes;  ///< [m], each file once a scale
  std::vector<int> instances;  ///< whose files have some: their collision shapes can be hidden
  /// What could not be shown, and why; what was made coarser.
  std::vector<std::string> notes;
};

/// More triangles than these are merged: of one mesh, of all of a scene.
inline constexpr std::size_t kMaxVisualTriangles = 20'000;
inline constexpr std::size_t kMaxAllVisualTriangles = 120'000;

/// The visuals of every robot of a scene (.yaml) or of a lone robot (.urdf), which was read into
/// `model`. Empty where they show the same as its collision shapes. Mesh files are looked for, and
/// allowed, as those of collision shapes (find_mesh); one that is missing or unreadable is
/// a note. packages: as SceneOverrides has them. @throws InputError where the scene's file is gone.
Visuals read_visuals(const std::filesystem::path& scene_file, const Model& model,
                     const std::map<std::string, std::filesystem::path>& packages);

/// Merges vertices by cells of a grid, the finest one that leaves at most `most` triangles.
void make_coarser(TriangleMesh& mesh, std::size_t most);

}  // namespace counterpoint::view
