#include "counterpoint/model/files/file_format.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <optional>

#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

constexpr std::string_view kColumnPrefix = "format.";

/// Reads the numbers of "MAJOR.MINOR"; more may follow "MAJOR.MINOR." if `patch`.
std::optional<std::array<int, 2>> parse_format(std::string_view text, bool patch) {
  std::array<int, 2> numbers{};
  const char *at = text.data(), *const end = text.data() + text.size();
  for (size_t i = 0; i < 2; ++i) {
    const bool apart = i == 0 || (at != end && *at++ == '.');
    const auto [stop, error] = std::from_chars(at, end, numbers[i]);
    if (!apart || error != std::errc() || numbers[i] < 0) return std::nullopt;
    at = stop;
  }
  if (at != end && !patch) return std::nullopt;
  return numbers;
}

}  // namespace

std::string file_format() {
  const auto own = parse_format(COUNTERPOINT_VERSION, true).value();
  return fmt::format("{}.{}", own[0], own[1]);
}

std::string format_column() { return std::string(kColumnPrefix) + file_format(); }

std::string_view format_of_column(std::string_view name) {
  if (!name.starts_with(kColumnPrefix)) return {};
  name.remove_prefix(kColumnPrefix.size());
  return parse_format(name, false) ? name : std::string_view();
}

void check_file_format(std::string_view stated, const std::string& where) {
  const auto format = parse_format(stated, false);
  if (!format)
    throw InputError(fmt::format("{}: '{}' is no format; MAJOR.MINOR is expected, such as {}",
                                 where, stated, file_format()));
  if (*format > parse_format(COUNTERPOINT_VERSION, true).value())
    throw InputError(
        fmt::format("{}: the file has format {}, and counterpoint {} reads formats up to {}; "
                    "install version {} or later",
                    where, stated, COUNTERPOINT_VERSION, file_format(), stated));
}

}  // namespace counterpoint
