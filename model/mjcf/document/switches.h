// What <option> and its <flag> switch off.
#pragma once

#include <set>
#include <string>

namespace counterpoint::mjcf {

struct Switches {
  std::set<std::string> off;  ///< words of <flag> that say "disable"
  bool pairs_only = false;    ///< collision="predefined"
  bool no_pairs = false;      ///< collision="dynamic"
  std::set<int> groups_off;   ///< actuatorgroupdisable

  /// `constraint` stands for all four kinds.
  bool constraint_off(const char* kind) const {
    return off.count(kind) > 0 || off.count("constraint") > 0;
  }
};

}  // namespace counterpoint::mjcf
