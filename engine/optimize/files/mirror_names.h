// Names of the left and the right side. Internal header.
#pragma once

#include <string>
#include <utility>

namespace counterpoint::optimization {

/// Returns the name with `left` replaced by `right` or vice versa; unchanged if it has neither.
inline std::string partner_name(const std::string& name, const std::string& left,
                                const std::string& right) {
  for (const auto& [from, to] : {std::pair(left, right), std::pair(right, left)})
    if (const std::size_t at = name.find(from); at != std::string::npos)
      return name.substr(0, at) + to + name.substr(at + from.size());
  return name;
}

}  // namespace counterpoint::optimization
