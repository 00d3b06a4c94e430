// Helpers for motion capture formats: units of length, unique names.
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
