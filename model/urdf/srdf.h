// SRDF files: the pairs of links that never collide, as MoveIt's setup assistant found.
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
    std::string reason;  ///< as the file says, maybe empty: "Never", "Adjacent", "Default", ...
    std::string where;   ///< file and line
  };
  std::vector<Pair> disabled;
  std::vector<Note> notes;  ///< what bears on collision and is not used
};

/// Reads <disable_collisions>; everything else in the file has other uses. @throws InputError with
/// file and line when the file is missing or no XML, its root is not <robot>, or a link is not
/// named.
Srdf load_srdf(const std::filesystem::path& file);

/// Excludes the pairs from collision, `prefix` before the names of their links. @throws InputError
/// with file and line when the robot has no such link.
void exclude_disabled_pairs(const Srdf& srdf, const std::string& prefix, ModelBuilder& builder);

}  // namespace counterpoint
