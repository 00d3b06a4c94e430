// What stands beside the trees of a model that a file describes, whatever its format.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

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
