// Text as users and files write it: whole files up to a limit of size, numbers, nearest names, YAML
// with line numbers.
#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace tinyxml2 {
class XMLDocument;
}

namespace counterpoint {

// ---- Whole text files in memory, up to a limit of size.

/// Why a file cannot be opened: "there is no such file", "a folder; a file is expected", or what
/// the system says.
std::string why_unreadable(const std::filesystem::path& file);

/// The bytes of a file. Pipes are read to their end. @throws InputError: "FILE: `missing`" where it
/// is not there, why_unreadable where it cannot be opened, and when it is longer than `max_bytes`.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t max_bytes,
                           const char* missing);

/// The faults of a file, said together: what one part of the reading throws is kept, and reading
/// goes on with the next.
class Faults {
 public:
  template <class Part>
  void collect(Part&& part) {
    try {
      part();
    } catch (const InputError& error) {
      add(error.what());
      broken_ = true;
    }
  }
  void add(const std::string& fault);
  bool any() const { return !faults_.empty(); }
  /// Was a part not read to its end? Names that it gives may then be missing.
  bool broken() const { return broken_; }
  /// @throws InputError with all of them, one a line, the first 20 in full.
  void throw_if_any() const;

 private:
  std::vector<std::string> faults_;
  bool broken_ = false;
};

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

/// The text of an XML file, parsed. @throws InputError with file, line and what is wrong in plain
/// words.
void parse_xml(const std::filesystem::path& file, const std::string& text,
               tinyxml2::XMLDocument& document);

/// The name of the root element of an XML file, or "". @throws InputError as parse_xml_file.
std::string root_element_name(const std::filesystem::path& file);

// ---- A number as a user or a file writes it.

/// The whole text as a number, a sign + before it allowed, whatever the locale (unlike strtod); may
/// be infinite or NaN where the text says so. Nothing if it is none.
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

// ---- YAML with line numbers: every wrong value is reported as "file:line: what, what was
// expected".

/// A whole YAML file, of the extent that model/limits.h allows. @throws InputError with file and
/// line. `missing`: what to say when there is no such file.
YAML::Node load_yaml_file(const std::filesystem::path& file, const char* missing);

/// A YAML value together with the file it stands in. All readers throw InputError with file and
/// line.
class YamlValue {
 public:
  /// As load_yaml_file.
  static YamlValue load(const std::filesystem::path& file);

  bool has(const char* key) const { return node_.IsMap() && node_[key].IsDefined(); }
  /// The value under a key of a map; an error if it is missing.
  YamlValue at(const char* key) const;
  bool is_map() const { return node_.IsMap(); }
  bool is_list() const { return node_.IsSequence(); }
  bool is_text(const char* text) const { return node_.IsScalar() && node_.Scalar() == text; }

  /// Refuses keys that are unknown or repeated, naming those that are known.
  void expect_map(std::initializer_list<const char*> known) const;
  std::vector<YamlValue> list() const;
  /// Key and value, in file order; an error if a key is given twice.
  std::vector<std::pair<std::string, YamlValue>> entries() const;

  std::string text() const;
  bool boolean() const;
  double number() const;
  int integer(int low, int high) const;
  double number(double low, double high) const;  ///< both ends included
  double positive() const;
  std::vector<double> numbers() const;  ///< a number, or a list of them
  Vector3 vector3() const;

  [[noreturn]] void fail(const std::string& message) const;
  std::string where() const;

 private:
  YamlValue(const YAML::Node& node, std::string file, std::string path)
      : node_(node), file_(std::move(file)), path_(std::move(path)) {}

  YAML::Node node_;
  std::string file_, path_;  // path_: "models[1].position"
};

}  // namespace counterpoint
