// A scene for other programs: as MJCF (MuJoCo), or as URDF.
//
// Both say what the format can: bodies, inertias, joints, shapes, materials. What it cannot is
// listed, never left out in silence. Numbers are written with 17 digits, so that what is read back
// is what was written but for one rounding of frames. The bodies are those of the model: links that
// fixed joints hold are merged, and a joint's axis is z of its body's frame.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// A file to be written beside the exported one.
struct ExportedFile {
  std::string name;  ///< relative to the folder of the exported file
  std::string text;
};

struct Exported {
  std::string text;                 ///< the document
  std::vector<ExportedFile> files;  ///< what it refers to: meshes
  std::vector<Note> lost;           ///< what the format cannot say
};

/// MJCF of the whole scene, its start as keyframe "start". Contacts are as stiff as MuJoCo's solver
/// takes well (solref 2 h, solimp 0.9999, elliptic cones, impratio 100); both engines' contact
/// models differ. `apart`: pairs of geometries that do not collide beyond those that the model
/// excludes (collision::Collider::overlapping_pairs). @throws InputError for what would be another
/// model: a plane that moves.
Exported export_mjcf(const Scene& scene, const std::vector<std::pair<int, int>>& apart = {});

/// URDF of one robot: trees that hang on the world by joints, or one that floats. The start is not
/// in it, nor what lies on the world. `mesh_folder`: where the meshes (OBJ, [m]) are put and looked
/// for, relative to the file. @throws InputError if the scene holds several robots: more than one
/// tree, one of them floating.
Exported export_urdf(const Scene& scene, const std::string& mesh_folder = "meshes");

}  // namespace counterpoint
