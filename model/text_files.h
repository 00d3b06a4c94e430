// Text as users and files write it: whole files up to a limit of size, numbers, nearest names.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
}

namespace counterpoint {

// ---- Whole text files in memory, up to a limit of size.

/// The bytes of a file. Pipes are read to their end. @throws InputError: "FILE: `missing`" where it
/// cannot be opened or is a folder, and when it is longer than `max_bytes`.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t max_bytes,
                           const char* missing);

/// Without the characters of `blank` at its ends.
inline std::string_view trimmed(std::string_view text, std::string_view blank) {
  const auto begin = text.find_first_not_of(blank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blank) - begin + 1);
}

/// An XML file: as above, and refused when it defines entities or a document type (they could
/// multiply it, and no format here needs them) or has more marks than limits::kMaxXmlMarks.
std::string read_xml_file(const std::filesystem::path& file, const char* missing);

/// An XML file, read as above and parsed. @throws InputError, also with file and line where it is
/// not well-formed.
void parse_xml_file(const std::filesystem::path& file, const char* missing,
                    tinyxml2::XMLDocument& document);

/// The name of the root element of an XML file, or "". @throws InputError as parse_xml_file.
std::string root_element_name(const std::filesystem::path& file);

// ---- A number as a user or a file writes it.

/// The whole text as a number, a sign + before it allowed, whatever the locale (unlike strtod); may be infinite or NaN
/// where the text says so. Nothing if it is none.
inline std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

// ---- Edit distance of two names, to suggest the nearest one.

/// Letters to be put in, taken out or changed to make one word of the other (Levenshtein).
inline int edit_distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (const char letter : a) {
    int diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const int changed = diagonal + (letter == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace counterpoint
