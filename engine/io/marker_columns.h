// Helpers for the formats of motion capture: units of length, names that occur once.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace counterpoint {

/// How many of this unit of length a metre has; nothing where the unit is not known.
inline std::optional<double> units_per_metre(std::string_view unit) {
  std::string lower(unit);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == "mm") return 1000.0;
  if (lower == "cm") return 100.0;
  if (lower == "m") return 1.0;
  return std::nullopt;
}

/// Names of columns that shall occur once.
class UniqueNames {
 public:
  /// Takes the name, with _2, _3 ... after it where it is taken.
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
  std::map<std::string, int> last_;  ///< the last number after a name
};

}  // namespace counterpoint
