// Names and messages shared by the source files of ModelBuilder. Private to the model folder.
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

/// Data of the robot that is being added.
struct ModelBuilder::Placement {
  int instance = 0;
  std::string prefix;
  int assembly = -1;  ///< assembly of the link being added (Geometry::assembly)
};

inline std::string located_at(const std::string& where, const std::string& what) {
  return where.empty() ? what : where + ": " + what;
}

/// Returns "'a', 'b', 'c', ... (12 in all)" for messages.
template <typename Map>
std::string listed(const Map& names) {
  constexpr size_t kShown = 12;
  std::string list;
  size_t n = 0;
  for (const auto& [name, index] : names) {
    if (n++ == kShown) return fmt::format("{}, ... ({} in all)", list, names.size());
    list += (list.empty() ? "'" : ", '") + name + "'";
  }
  return list.empty() ? "none" : list;
}

/// Index of each name.
using NameIndex = std::map<std::string, int>;

/// Registers a name with its index. @throws InputError if it is taken.
inline void take_name(NameIndex& names, const std::string& name, int index,
                      const std::string& where, const char* kind) {
  if (names.emplace(name, index).second) return;
  throw InputError(located_at(
      where, fmt::format("there is already a {} named '{}'; give each model of a scene its own "
                         "name, or rename it",
                         kind, name)));
}

}  // namespace counterpoint
