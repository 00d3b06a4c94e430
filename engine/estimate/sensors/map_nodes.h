// Reader of YAML nodes of a column map, with errors that name file, line and key.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::estimation {

/// All functions throw InputError if the node does not have the expected form.
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
  /// Reads an integer from 1 to 1,000,000.
  int count(const YAML::Node& node, const std::string& what) const;
  /// Reads three numbers.
  Vector3 vector(const YAML::Node& node, const std::string& what) const;
  /// Reads a column name, a number (constant), or {column, scale, offset}.
  ColumnSource source(const YAML::Node& node, const std::string& what) const;
  /// Reads a column, {column, scale, offset}, or a list of these to be summed, such as seconds and
  /// nanoseconds in two columns.
  std::vector<ColumnSource> time(const YAML::Node& node) const;
  /// Finds a link of the scene by name.
  const Frame& link(const YAML::Node& node) const;

 private:
  std::string file_;
  const Model& model_;
  CoordinateNames names_;
};

}  // namespace counterpoint::estimation
