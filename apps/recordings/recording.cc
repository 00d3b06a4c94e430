#include "recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/yaml_reader.h"

namespace counterpoint::apps {
namespace {

/// Recordings carry few digits: a quaternion this far from unit length is still one.
constexpr double kQuaternionTolerance = 1e-3;
constexpr int kMaxSubsteps = 1'000'000;  // between two rows

class MapReader {
 public:
  MapReader(const std::filesystem::path& file, const Model& model)
      : file_(file.string()), model_(model), names_(coordinate_names(model)) {}

  ColumnMap read() const {
    const YAML::Node root = load_yaml_file(file_, "cannot be read; expected a YAML column map");
    check_keys(root, {"columns", "free", "rate", "time", "substeps", "velocities"});
    ColumnMap map;
    read_time(root, map);
    if (const YAML::Node node = root["substeps"]) {
      map.substeps = count(node, "substeps");
    }
    if (const YAML::Node node = root["velocities"]) {
      const std::string text = scalar(node, "velocities");
      if (text != "instantaneous" && text != "backward_difference") {
        fail(node,
             fmt::format("velocities: '{}'; expected instantaneous or backward_difference", text));
      }
      map.backward_difference = text == "backward_difference";
    }
    const YAML::Node columns = root["columns"];
    if (!columns || !columns.IsMap() || columns.size() == 0) {
      fail(root, "expected 'columns': a map from trajectory columns to columns of the recording");
    }
    refuse_repeated_keys(columns);
    for (const auto& pair : columns) map.entries.push_back(entry(pair.first, pair.second));
    if (const YAML::Node node = root["free"]) map.free_body = free_body(node, map);
    return map;
  }

 private:
  [[noreturn]] void fail(const YAML::Node& node, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_, node.Mark().line + 1, message));
  }

  void check_keys(const YAML::Node& node, const std::set<std::string>& known) const {
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

  void refuse_repeated_keys(const YAML::Node& map) const {
    std::set<std::string> seen;
    for (const auto& pair : map) {
      const std::string key = scalar(pair.first, "key");
      if (!seen.insert(key).second) fail(pair.first, fmt::format("'{}' is given twice", key));
    }
  }

  std::string scalar(const YAML::Node& node, const std::string& what) const {
    if (!node.IsScalar()) fail(node, fmt::format("{}: expected a single value", what));
    return node.Scalar();
  }

  double number(const YAML::Node& node, const std::string& what) const {
    const std::string text = scalar(node, what);
    double value = 0.0;
    if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      fail(node, fmt::format("{}: '{}' is no finite number", what, text));
    }
    return value;
  }

  double positive(const YAML::Node& node, const std::string& what) const {
    const double value = number(node, what);
    if (!(value > 0.0)) fail(node, fmt::format("{}: {} is not positive", what, value));
    return value;
  }

  int count(const YAML::Node& node, const std::string& what) const {
    const double value = positive(node, what);
    if (value != std::floor(value) || value > kMaxSubsteps) {
      fail(node, fmt::format("{}: {} is no whole number from 1 to {}", what, value, kMaxSubsteps));
    }
    return static_cast<int>(value);
  }

  /// A column name, a number (constant), or {column, scale, offset}.
  ColumnSource source(const YAML::Node& node, const std::string& what) const {
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

  void read_time(const YAML::Node& root, ColumnMap& map) const {
    if (static_cast<bool>(root["rate"]) == static_cast<bool>(root["time"])) {
      fail(root, "expected either 'rate' (rows per second) or 'time' (the column of the time)");
    }
    if (root["rate"]) map.rate = positive(root["rate"], "rate");
    if (root["time"]) map.time = source(root["time"], "time");
    if (root["time"] && map.time.column.empty()) fail(root["time"], "time: expected a column");
  }

  ColumnMap::Entry entry(const YAML::Node& key, const YAML::Node& value) const {
    using Kind = ColumnMap::Entry::Kind;
    const std::string name = scalar(key, "columns");
    for (const auto& [kind, list] :
         {std::pair{Kind::kPosition, &names_.q}, std::pair{Kind::kVelocity, &names_.v},
          std::pair{Kind::kForce, &names_.force}}) {
      const auto it = std::find(list->begin(), list->end(), name);
      if (it != list->end()) {
        return {kind, static_cast<int>(it - list->begin()), name, source(value, name)};
      }
    }
    fail(key, fmt::format("'{}' is no coordinate of this scene; there are: {}", name,
                          fmt::join(names_.q, ", ")));
  }

  int free_body(const YAML::Node& node, const ColumnMap& map) const {
    const std::string link = scalar(node, "free");
    for (int i = 1; i < model_.num_bodies(); ++i) {
      if (model_.joint(i - 1).link != link) continue;
      const Body& body = model_.body(i);
      if (body.joint_type != JointType::kFloating) break;
      for (int k = body.q_index; k < body.q_index + 7; ++k) {
        const bool mapped = std::any_of(map.entries.begin(), map.entries.end(), [&](const auto& e) {
          return e.kind == ColumnMap::Entry::Kind::kPosition && e.index == k;
        });
        if (!mapped) fail(node, fmt::format("free: 'columns' says nothing about {}", names_.q[k]));
      }
      return i;
    }
    fail(node, fmt::format("free: '{}' is no floating link of this scene", link));
  }

  std::string file_;
  const Model& model_;
  CoordinateNames names_;
};

double evaluate(const ColumnSource& source, const CsvTable& table, int row) {
  if (source.column.empty()) return source.offset;
  const double value = source.scale * table.value(row, table.column(source.column)) + source.offset;
  if (std::isfinite(value)) return value;
  throw InputError(
      fmt::format("{}: column '{}': scale and offset of the column map make {} of it; a "
                  "finite number is expected",
                  table.where(row), source.column, value));
}

void normalize_quaternions(const CsvTable& table, const Model& model, int row,
                           Eigen::Ref<VectorX> q) {
  for (const Body& body : model.bodies()) {
    const bool floating = body.joint_type == JointType::kFloating;
    if (body.tree < 0 || (!floating && body.joint_type != JointType::kSpherical)) continue;
    auto quaternion = q.segment<4>(body.q_index + (floating ? 3 : 0));
    const double norm = quaternion.norm();
    if (!(std::abs(norm - 1.0) <= kQuaternionTolerance)) {
      throw InputError(fmt::format("{}: the quaternion has length {:.6g}; expected 1 within {}",
                                   table.where(row), norm, kQuaternionTolerance));
    }
    quaternion /= norm;
  }
}

}  // namespace

ColumnMap load_column_map(const std::filesystem::path& file, const Model& model) {
  return MapReader(file, model).read();
}

Recording read_recording(const std::filesystem::path& file, const ColumnMap& map,
                         const Model& model, const VectorX& start_q, const VectorX& start_v) {
  using Kind = ColumnMap::Entry::Kind;
  const CsvTable table(file);
  const int rows = table.num_rows();
  if (rows < 2)
    throw InputError(fmt::format("{}: {} rows; expected two or more", table.file(), rows));
  Recording recording;
  recording.file = table.file();
  recording.q = start_q.replicate(1, rows);
  recording.v = start_v.replicate(1, rows);
  recording.applied_force = MatrixX::Zero(model.nv(), rows);
  for (int row = 0; row < rows; ++row) {
    recording.time.push_back(map.rate ? row / *map.rate : evaluate(map.time, table, row));
    if (row > 0 && !(recording.time[row] > recording.time[row - 1])) {
      throw InputError(
          fmt::format("{}: time {} does not rise", table.where(row), recording.time[row]));
    }
    for (const ColumnMap::Entry& entry : map.entries) {
      MatrixX& block = entry.kind == Kind::kPosition   ? recording.q
                       : entry.kind == Kind::kVelocity ? recording.v
                                                       : recording.applied_force;
      block(entry.index, row) = evaluate(entry.source, table, row);
    }
    normalize_quaternions(table, model, row, recording.q.col(row));
  }
  return recording;
}

}  // namespace counterpoint::apps
