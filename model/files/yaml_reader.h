// YAML with line numbers: every wrong value is reported as "file:line: what, what was expected".
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// A whole YAML file, of the extent that model/limits.h allows. @throws InputError with file and line.
/// `missing`: what to say when there is no such file.
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
