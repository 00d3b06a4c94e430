// A number as a user or a file writes it.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace counterpoint {

/// The whole text as a number, a sign + before it allowed, whatever the locale (unlike strtod); may be infinite or NaN
/// where the text says so. Nothing if it is none.
inline std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace counterpoint
