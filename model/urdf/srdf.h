// SRDF files: pairs of links that never collide, as found by MoveIt's setup assistant.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

struct Srdf {
  struct Pair {
    std::string link_a, link_b;
    std::string reason;  ///< text in the file, may be empty: "Never", "Adjacent", "Default", ...
    std::string where;   ///< file and line
  };
  std::vector<Pair> disabled;
  std::vector<Note> notes;  ///< collision settings that are not used
};

/// Reads <disable_collisions>; other elements are not used. @throws InputError with file and line
/// if the file is missing or malformed XML, its root is not <robot>, or a link name is missing.
Srdf load_srdf(const std::filesystem::path& file);

/// Excludes the pairs from collision; `prefix` precedes the link names. @throws InputError with
/// file and line if the robot has no such link.
void exclude_disabled_pairs(const Srdf& srdf, const std::string& prefix, ModelBuilder& builder);

}  // namespace counterpoint
