// How a file of a model is read, and what it describes beside trees, whatever its format.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/mesh/mesh.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {

struct ModelFileOptions {
  /// package:// roots: NAME -> folder, which meshes and included files may lie in.
  std::map<std::string, std::filesystem::path> packages;
  /// Opt-in: makes non-physical inertias physical (nearest one meeting the triangle inequality) and
  /// notes each. Off: they are used as they are where that can be simulated, noted, or refused.
  bool repair_inertias = false;
  /// Where hulls are shared with other files; none: each file has its own.
  std::shared_ptr<HullCache> hulls;
};

struct ModelParts {
  /// Fixed to the world.
  struct Environment {
    std::string name;
    Shape shape;
    Pose X_WG;
    Material material;
  };
  /// Links or geometries that never touch.
  struct Exclusion {
    std::string a, b;
    std::string reason;
  };
  struct Surface {
    std::string a, b;
    PairSurface surface;
  };

  std::vector<Environment> environment;
  std::vector<ClosureSpec> closures;
  std::vector<Exclusion> exclusions;
  std::vector<Surface> surfaces;
};

/// Puts them into a builder that has their links, placed and prefixed. @throws InputError as the
/// builder.
void add_parts(const ModelParts& parts, const Pose& X_WL, const std::string& prefix,
               ModelBuilder& builder);

}  // namespace counterpoint
