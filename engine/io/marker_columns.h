// What the formats of motion capture share: lengths in metres, names that occur once.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
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

/// The name, with _2, _3 ... after it where it is taken; takes it.
inline std::string unique_name(const std::string& name, std::set<std::string>& taken) {
  std::string unique = name;
  for (int i = 2; !taken.insert(unique).second; ++i) unique = fmt::format("{}_{}", name, i);
  return unique;
}

}  // namespace counterpoint
