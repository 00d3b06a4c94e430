#include "counterpoint/engine/estimate/recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

/// Recordings carry few digits: a quaternion this far from unit length is still one.
constexpr double kQuaternionTolerance = 1e-3;
/// The mean of quaternions this much shorter is one of turns by some 40 degrees.
constexpr double kAverageTolerance = 0.02;
constexpr int kMaxSubsteps = 1'000'000;  // between two rows

class MapReader {
 public:
  MapReader(const std::filesystem::path& file, const Model& model)
      : file_(file.string()), model_(model), names_(coordinate_names(model)) {}

  ColumnMap read() const {
    const YAML::Node root = load_yaml_file(file_, "cannot be read; expected a YAML column map");
    if (root.IsMap() && root["after"]) return read_impacts(root);
    check_keys(root, {"columns", "free", "rate", "time", "substeps", "velocities", "average",
                      "pieces", "angular_velocity", "after", "skip"});
    if (root["skip"]) fail(root["skip"], "skip: is of impacts; expected 'after' beside it");
    ColumnMap map;
    read_time(root, map);
    if (const YAML::Node node = root["substeps"]) {
      map.substeps = count(node, "substeps");
    }
    if (const YAML::Node node = root["angular_velocity"]) {
      const std::string text = scalar(node, "angular_velocity");
      if (text != "body" && text != "world")
        fail(node, fmt::format("angular_velocity: '{}'; expected body or world", text));
      map.world_angular = text == "world";
    }
    if (const YAML::Node node = root["average"]) {
      map.average = count(node, "average");
      if (map.average % 2 == 0)
        fail(node, fmt::format("average: {} is even; expected an odd number of rows", map.average));
    }
    if (const YAML::Node node = root["pieces"]) map.pieces = count(node, "pieces");
    if (const YAML::Node node = root["velocities"]) {
      const std::string text = scalar(node, "velocities");
      if (text != "instantaneous" && text != "backward_difference") {
        fail(node,
             fmt::format("velocities: '{}'; expected instantaneous or backward_difference", text));
      }
      map.backward_difference = text == "backward_difference";
    }
    map.entries = entries(root, "columns");
    if (const YAML::Node node = root["free"]) map.free_body = free_body(node, map);
    return map;
  }

 private:
  /// Rows of states before and velocities after.
  ColumnMap read_impacts(const YAML::Node& root) const {
    check_keys(root, {"columns", "after", "skip"});
    ColumnMap map;
    map.rate = 1.0;
    map.entries = entries(root, "columns");
    map.after = entries(root, "after");
    for (const std::vector<ColumnMap::Entry>* list : {&map.entries, &map.after})
      for (const ColumnMap::Entry& e : *list)
        if (e.kind == ColumnMap::Entry::Kind::kForce ||
            (list == &map.after && e.kind == ColumnMap::Entry::Kind::kPosition))
          fail(root["after"],
               fmt::format("'{}': of impacts, 'columns' are positions and velocities "
                           "before, 'after' velocities",
                           e.name));
    if (const YAML::Node node = root["skip"]) {
      if (!node.IsSequence()) fail(node, "skip: expected a list of columns");
      for (const auto& column : node) map.skip.push_back(scalar(column, "skip"));
    }
    return map;
  }

  std::vector<ColumnMap::Entry> entries(const YAML::Node& root, const char* key) const {
    const YAML::Node columns = root[key];
    if (!columns || !columns.IsMap() || columns.size() == 0) {
      fail(root,
           fmt::format("expected '{}': a map from trajectory columns to columns of the recording",
                       key));
    }
    refuse_repeated_keys(columns);
    std::vector<ColumnMap::Entry> out;
    for (const auto& pair : columns) out.push_back(entry(pair.first, pair.second));
    return out;
  }

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

double evaluate(const ColumnSource& source, const Table& table, int row) {
  if (source.column.empty()) return source.offset;
  const double value = source.scale * table.value(row, table.column(source.column)) + source.offset;
  if (std::isfinite(value)) return value;
  throw InputError(
      fmt::format("{}: column '{}': scale and offset of the column map make {} of it; a "
                  "finite number is expected",
                  table.where(row), source.column, value));
}

/// visit(where in q its quaternion starts, where in v its angular velocity does) for every free
/// orientation.
template <class Visit>
void for_each_quaternion(const Model& model, Visit visit) {
  for (const Body& body : model.bodies()) {
    const bool floating = body.joint_type == JointType::kFloating;
    if (body.tree < 0 || (!floating && body.joint_type != JointType::kSpherical)) continue;
    visit(body.q_index + (floating ? 3 : 0), body.v_index + (floating ? 3 : 0));
  }
}

void normalize_quaternions(const Model& model, double tolerance, const std::string& where,
                           Eigen::Ref<VectorX> q) {
  for_each_quaternion(model, [&](int at, int) {
    auto quaternion = q.segment<4>(at);
    const double norm = quaternion.norm();
    if (!(std::abs(norm - 1.0) <= tolerance)) {
      throw InputError(fmt::format("{}: the quaternion has length {:.6g}; expected 1 within {}",
                                   where, norm, tolerance));
    }
    quaternion /= norm;
  });
}

void turn_into_body_axes(const Model& model, const VectorX& q, Eigen::Ref<VectorX> v) {
  for_each_quaternion(model, [&](int at, int v_at) {
    const Quaternion orientation(q[at], q[at + 1], q[at + 2], q[at + 3]);
    v.segment<3>(v_at) = orientation.conjugate() * Vector3(v.segment<3>(v_at));
  });
}

Recording read_rows(const Table& table, const ColumnMap& map, const Model& model,
                    const VectorX& start_q, const VectorX& start_v) {
  using Kind = ColumnMap::Entry::Kind;
  const int rows = table.num_rows();
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
    normalize_quaternions(model, kQuaternionTolerance, table.where(row), recording.q.col(row));
    if (map.world_angular) turn_into_body_axes(model, recording.q.col(row), recording.v.col(row));
  }
  return recording;
}

/// One for each row that is not to be skipped.
std::vector<Recording> read_impacts(const Table& table, const ColumnMap& map, const Model& model,
                                    const VectorX& start_q, const VectorX& start_v) {
  const Recording rows = read_rows(table, map, model, start_q, start_v);
  std::vector<Recording> out;
  for (int row = 0; row < rows.num_rows(); ++row) {
    const bool skip = std::any_of(map.skip.begin(), map.skip.end(), [&](const std::string& column) {
      return table.value(row, table.column(column)) != 0.0;
    });
    if (skip) continue;
    Recording& impact = out.emplace_back();
    impact.file = table.where(row);
    impact.time = {0.0, 0.0};
    impact.q = rows.q.col(row).replicate(1, 2);
    impact.v = rows.v.col(row).replicate(1, 2);
    for (const ColumnMap::Entry& entry : map.after)
      impact.v(entry.index, 1) = evaluate(entry.source, table, row);
    impact.applied_force = MatrixX::Zero(model.nv(), 2);
  }
  if (out.empty())
    throw InputError(fmt::format("{}: no impact is left; all {} rows are skipped", table.file(),
                                 table.num_rows()));
  return out;
}

/// Rows from `first` on.
Recording part(const Recording& whole, int first, int rows) {
  Recording out;
  out.file = whole.file;
  out.time.assign(whole.time.begin() + first, whole.time.begin() + first + rows);
  out.q = whole.q.middleCols(first, rows);
  out.v = whole.v.middleCols(first, rows);
  out.applied_force = whole.applied_force.middleCols(first, rows);
  return out;
}

/// Every row the mean of `count` rows around it; rows without so many around them are left out.
Recording averaged(const Recording& recording, int count, const Model& model) {
  const int rows = recording.num_rows() - count + 1;
  if (rows < 2)
    throw InputError(fmt::format("{}: {} rows; expected {} or more, to average over {}",
                                 recording.file, recording.num_rows(), count + 1, count));
  Recording out = part(recording, count / 2, rows);
  for (int row = 0; row < rows; ++row) {
    out.q.col(row) = recording.q.middleCols(row, count).rowwise().mean();
    out.v.col(row) = recording.v.middleCols(row, count).rowwise().mean();
    out.applied_force.col(row) = recording.applied_force.middleCols(row, count).rowwise().mean();
    normalize_quaternions(model, kAverageTolerance,
                          fmt::format("{}: mean over {} rows", recording.file, count),
                          out.q.col(row));
  }
  return out;
}

}  // namespace

ColumnMap load_column_map(const std::filesystem::path& file, const Model& model) {
  return MapReader(file, model).read();
}

std::vector<Recording> read_recordings(const std::filesystem::path& file, const ColumnMap& map,
                                       const Model& model, const VectorX& start_q,
                                       const VectorX& start_v) {
  const Table table(file);
  if (!map.after.empty()) return read_impacts(table, map, model, start_q, start_v);
  Recording whole = read_rows(table, map, model, start_q, start_v);
  if (map.average > 1) whole = averaged(whole, map.average, model);
  const int rows = whole.num_rows();
  if (rows < 2 * map.pieces)
    throw InputError(fmt::format("{}: {} rows; expected two or more{}", table.file(), rows,
                                 map.pieces > 1 ? " for each piece" : ""));
  if (map.pieces == 1) return {whole};
  std::vector<Recording> out;
  for (int k = 0; k < map.pieces; ++k) {
    const int first = static_cast<int>(static_cast<long>(rows) * k / map.pieces);
    const int last = static_cast<int>(static_cast<long>(rows) * (k + 1) / map.pieces);
    out.push_back(part(whole, first, last - first));
    out.back().file += fmt::format(" from {:.6g} s", out.back().time[0]);
  }
  return out;
}

std::vector<Recording> read_all(const std::vector<std::string>& files, const ColumnMap& map,
                                const Scene& scene) {
  std::vector<Recording> out;
  for (const std::string& file : files)
    for (Recording& one : read_recordings(file, map, scene.model, scene.q, scene.v))
      out.push_back(std::move(one));
  return out;
}

}  // namespace counterpoint::estimation
