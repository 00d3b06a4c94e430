// Text input: whole files up to a size limit, numbers, name suggestions, YAML with line numbers.
#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace tinyxml2 {
class XMLDocument;
}

namespace counterpoint {

// ---- Whole text files in memory, up to a size limit.

/// Returns the reason why a file cannot be opened: "there is no such file", "a folder; a file is
/// expected", or the system's message.
std::string why_unreadable(const std::filesystem::path& file);

/// Returns the bytes of a file; pipes are read to their end. @throws InputError: "FILE: `missing`"
/// if it does not exist, with why_unreadable if it cannot be opened, and when it is longer than
/// `max_bytes`.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t max_bytes,
                           const char* missing);

/// Collects the errors of a file so that they are reported together: an error in one part is kept,
/// and reading goes on with the next part.
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
  /// True if a part was not read to its end: names that it defines may be missing.
  bool broken() const { return broken_; }
  /// @throws InputError with all of them, one per line, the first 20 in full.
  void throw_if_any() const;

 private:
  std::vector<std::string> faults_;
  bool broken_ = false;
};

/// Returns the text without the characters of `blank` at its ends.
inline std::string_view trimmed(std::string_view text, std::string_view blank) {
  const auto begin = text.find_first_not_of(blank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blank) - begin + 1);
}

/// Returns the text of an XML file. @throws InputError as read_text_file, and when the file defines
/// entities or a document type (they could multiply its size, and no format here needs them) or has
/// more marks than limits::kMaxXmlMarks.
std::string read_xml_file(const std::filesystem::path& file, const char* missing);

/// Reads an XML file with read_xml_file and parses it. @throws InputError as that, and with file
/// and line where it is not well-formed.
void parse_xml_file(const std::filesystem::path& file, const char* missing,
                    tinyxml2::XMLDocument& document);

/// Parses the text of an XML file. @throws InputError with file, line and a description of the
/// error.
void parse_xml(const std::filesystem::path& file, const std::string& text,
               tinyxml2::XMLDocument& document);

/// Returns the name of the root element of an XML file, or "". @throws InputError as
/// parse_xml_file.
std::string root_element_name(const std::filesystem::path& file);

// ---- Numbers in text.

/// Parses the whole text as a number, with an optional sign +, independent of the locale (unlike
/// strtod). The result may be infinite or NaN if the text says so; nothing if it is not a number.
inline std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

// ---- Edit distance of two names, to suggest the nearest one.

/// Returns the Levenshtein distance: the number of letters to insert, delete or change to turn a
/// into b.
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

// ---- YAML with line numbers: an invalid value is reported as "file:line: value, expected value".

/// Returns a whole YAML file within the limits of model/limits.h. `missing` is the message when
/// there is no such file. @throws InputError with file and line.
YAML::Node load_yaml_file(const std::filesystem::path& file, const char* missing);

/// A YAML value with its file and path. All readers throw InputError with file and line.
class YamlValue {
 public:
  /// Loads a file as load_yaml_file does.
  static YamlValue load(const std::filesystem::path& file);

  /// Returns the map {a: {b: value}} for the key "a.b" and the text of a value. Errors name the
  /// key.
  static YamlValue setting(const std::string& key, const std::string& value);

  bool has(const char* key) const { return node_.IsMap() && node_[key].IsDefined(); }
  /// Returns the value under a key of a map; an error if it is missing.
  YamlValue at(const char* key) const;
  bool is_map() const { return node_.IsMap(); }
  bool is_list() const { return node_.IsSequence(); }
  bool is_text(const char* text) const { return node_.IsScalar() && node_.Scalar() == text; }

  /// Refuses unknown or repeated keys; the message lists the known ones.
  void expect_map(std::initializer_list<const char*> known,
                  std::span<const char* const> more = {}) const;
  std::vector<YamlValue> list() const;
  /// Returns keys and values in file order; an error if a key is repeated.
  std::vector<std::pair<std::string, YamlValue>> entries() const;

  std::string text() const;
  bool boolean() const;
  double number() const;
  int integer(int low, int high) const;
  double number(double low, double high) const;  ///< in the closed interval
  double positive() const;
  std::vector<double> numbers() const;  ///< one number, or a list of numbers
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
