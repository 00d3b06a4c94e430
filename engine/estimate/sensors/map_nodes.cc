#include "counterpoint/engine/estimate/sensors/map_nodes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace counterpoint::estimation {
namespace {

constexpr int kMostCount = 1'000'000;

}  // namespace

MapNodes::MapNodes(const std::filesystem::path& file, const Model& model)
    : file_(file.string()), model_(model), names_(coordinate_names(model)) {}

void MapNodes::fail(const YAML::Node& node, const std::string& message) const {
  throw InputError(fmt::format("{}:{}: {}", file_, node.Mark().line + 1, message));
}

void MapNodes::check_keys(const YAML::Node& node, const std::set<std::string>& known) const {
  if (!node.IsMap()) fail(node, "expected a map");
  refuse_repeated_keys(node);
  for (const auto& pair : node) {
    const std::string key = scalar(pair.first, "key");
    if (known.count(key) == 0) {
      fail(pair.first,
           fmt::format("unknown key '{}'; expected one of {}", key, fmt::join(known, ", ")));
    }
  }
}

void MapNodes::refuse_repeated_keys(const YAML::Node& map) const {
  std::set<std::string> seen;
  for (const auto& pair : map) {
    const std::string key = scalar(pair.first, "key");
    if (!seen.insert(key).second) fail(pair.first, fmt::format("'{}' is given twice", key));
  }
}

std::string MapNodes::scalar(const YAML::Node& node, const std::string& what) const {
  if (!node.IsScalar()) fail(node, fmt::format("{}: expected a single value", what));
  return node.Scalar();
}

double MapNodes::number(const YAML::Node& node, const std::string& what) const {
  const std::string text = scalar(node, what);
  double value = 0.0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(node, fmt::format("{}: '{}' is no finite number", what, text));
  }
  return value;
}

double MapNodes::positive(const YAML::Node& node, const std::string& what) const {
  const double value = number(node, what);
  if (!(value > 0.0)) fail(node, fmt::format("{}: {} is not positive", what, value));
  return value;
}

int MapNodes::count(const YAML::Node& node, const std::string& what) const {
  const double value = positive(node, what);
  if (value != std::floor(value) || value > kMostCount) {
    fail(node, fmt::format("{}: {} is no whole number from 1 to {}", what, value, kMostCount));
  }
  return static_cast<int>(value);
}

ColumnSource MapNodes::source(const YAML::Node& node, const std::string& what) const {
  ColumnSource result;
  if (node.IsMap()) {
    check_keys(node, {"column", "scale", "offset"});
    if (!node["column"]) fail(node, fmt::format("{}: expected 'column'", what));
    result.column = scalar(node["column"], what);
    if (node["scale"]) result.scale = number(node["scale"], what + ".scale");
    if (node["offset"]) result.offset = number(node["offset"], what + ".offset");
    return result;
  }
  double constant = 0.0;
  result.column = scalar(node, what);
  if (node.Tag() != "!" && YAML::convert<double>::decode(node, constant)) {  // "!": quoted
    result.column.clear();
    result.offset = number(node, what);
  }
  return result;
}

Vector3 MapNodes::vector(const YAML::Node& node, const std::string& what) const {
  if (!node.IsSequence() || node.size() != 3) fail(node, what + ": expected three numbers");
  Vector3 out;
  for (int i = 0; i < 3; ++i) out[i] = number(node[static_cast<std::size_t>(i)], what);
  return out;
}

std::vector<ColumnSource> MapNodes::time(const YAML::Node& node) const {
  std::vector<ColumnSource> out;
  if (node.IsSequence())
    for (const auto& part : node) out.push_back(source(part, "time"));
  else
    out.push_back(source(node, "time"));
  if (out.empty() ||
      std::any_of(out.begin(), out.end(), [](const auto& s) { return s.column.empty(); }))
    fail(node, "time: expected a column, {column: C, scale: S}, or a list of these, to be added");
  return out;
}

const Frame& MapNodes::link(const YAML::Node& node) const {
  const std::string name = scalar(node, "link");
  const int frame = model_.find_frame(name);
  if (frame < 0) {
    std::vector<std::string> links;
    for (const Frame& one : model_.frames()) links.push_back(one.name);
    fail(node,
         fmt::format("'{}' is no link of this scene; there are: {}", name, fmt::join(links, ", ")));
  }
  return model_.frames()[static_cast<std::size_t>(frame)];
}

}  // namespace counterpoint::estimation
