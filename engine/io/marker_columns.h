// Helpers for motion capture formats: units of length, axes, places of markers, unique names.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Returns the number of these units of length in a metre; nothing for an unknown unit.
inline std::optional<double> units_per_metre(std::string_view unit) {
  std::string lower(unit);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == "mm") return 1000.0;
  if (lower == "cm") return 100.0;
  if (lower == "m") return 1.0;
  return std::nullopt;
}

/// World axes x, y, z in terms of a file's axes: their letter, and 1 or -1.
using WorldAxes = std::array<std::pair<char, double>, 3>;
inline constexpr const char* kAxesExpected =
    "axes: expected the axes of the file along x, y, z of the world, as in [x, -z, y] where y "
    "points up";

/// Reads the names of axes, as in [x, -z, y] if the file's y axis points up; nothing if they are
/// others than x, y and z.
inline std::optional<WorldAxes> world_axes(const std::vector<std::string>& names) {
  WorldAxes out;
  std::string used;
  if (names.size() != out.size()) return std::nullopt;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool negative = names[i].starts_with('-');
    if (names[i].size() != (negative ? 2u : 1u)) return std::nullopt;
    out[i] = {names[i].back(), negative ? -1.0 : 1.0};
    used += names[i].back();
  }
  std::sort(used.begin(), used.end());
  if (used != "xyz") return std::nullopt;
  return out;
}

/// A marker on a link of a model.
struct MarkerPlace {
  std::string marker, link;
  Vector3 point;      ///< in the link's frame [m]
  std::string where;  ///< row of the table, for messages
};

/// Reads a table with the columns marker, link, x, y, z. @throws InputError naming file and row.
std::vector<MarkerPlace> read_marker_places(const std::filesystem::path& file);

/// Makes column names unique.
class UniqueNames {
 public:
  /// Returns the name, with _2, _3 ... appended if it is taken, and registers it.
  std::string take(const std::string& name) {
    std::string unique = name;
    for (int& last = last_.try_emplace(name, 1).first->second; !taken_.insert(unique).second;)
      unique = fmt::format("{}_{}", name, ++last);
    return unique;
  }
  bool has(const std::string& name) const { return taken_.count(name) > 0; }
  std::size_t size() const { return taken_.size(); }

 private:
  std::set<std::string> taken_;
  std::map<std::string, int> last_;  ///< last number appended to a name
};

}  // namespace counterpoint
