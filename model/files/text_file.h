// Whole text files in memory, up to a limit of size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace tinyxml2 {
class XMLDocument;
}

namespace counterpoint {

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

}  // namespace counterpoint
