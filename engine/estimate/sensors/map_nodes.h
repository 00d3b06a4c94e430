// Nodes of a column map's YAML, read with errors that name file, line and key.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"
#include "counterpoint/engine/motion_files.h"

namespace counterpoint::estimation {

/// All functions throw InputError where the node is not what they read.
class MapNodes {
 public:
  MapNodes(const std::filesystem::path& file, const Model& model);

  const std::string& file() const { return file_; }
  const Model& model() const { return model_; }
  const CoordinateNames& names() const { return names_; }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& message) const;
  void check_keys(const YAML::Node& node, const std::set<std::string>& known) const;
  void refuse_repeated_keys(const YAML::Node& map) const;
  std::string scalar(const YAML::Node& node, const std::string& what) const;
  double number(const YAML::Node& node, const std::string& what) const;
  double positive(const YAML::Node& node, const std::string& what) const;
  /// 1 to 1,000,000.
  int count(const YAML::Node& node, const std::string& what) const;
  /// Three numbers.
  Vector3 vector(const YAML::Node& node, const std::string& what) const;
  /// A column name, a number (constant), or {column, scale, offset}.
  ColumnSource source(const YAML::Node& node, const std::string& what) const;
  /// A column, {column, scale, offset}, or a list of these, to be added: seconds and nanoseconds in
  /// two columns.
  std::vector<ColumnSource> time(const YAML::Node& node) const;
  /// A link of the scene.
  const Frame& link(const YAML::Node& node) const;

 private:
  std::string file_;
  const Model& model_;
  CoordinateNames names_;
};

}  // namespace counterpoint::estimation
