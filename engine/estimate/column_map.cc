#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/motion_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

constexpr int kMaxSubsteps = 1'000'000;  // between two rows

class MapReader {
 public:
  MapReader(const std::filesystem::path& file, const Model& model)
      : file_(file.string()), model_(model), names_(coordinate_names(model)) {}

  ColumnMap read() const {
    const YAML::Node root =
        load_yaml_file(file_, "there is no such file; expected a YAML column map");
    if (root.IsMap() && root["after"]) return read_impacts(root);
    check_keys(root,
               {"columns", "free", "rate", "time", "substeps", "velocities", "average", "pieces",
                "angular_velocity", "linear_velocity", "names", "topic", "rows", "after", "skip",
                "contact_forces", "deviations"});
    if (root["skip"]) fail(root["skip"], "skip: is of impacts; expected 'after' beside it");
    ColumnMap map;
    read_time(root, map);
    if (const YAML::Node node = root["substeps"]) {
      map.substeps = count(node, "substeps");
    }
    map.world_angular = one_of(root, "angular_velocity", {"body", "world"}) == "world";
    map.body_linear = one_of(root, "linear_velocity", {"world", "body"}) == "body";
    map.table = table_options(root);
    if (const YAML::Node node = root["average"]) {
      map.average = count(node, "average");
      if (map.average % 2 == 0)
        fail(node, fmt::format("average: {} is even; expected an odd number of rows", map.average));
    }
    if (const YAML::Node node = root["pieces"]) map.pieces = count(node, "pieces");
    map.backward_difference =
        one_of(root, "velocities", {"instantaneous", "backward_difference"}) ==
        "backward_difference";
    map.entries = entries(root, "columns");
    if (const YAML::Node node = root["free"]) map.free_body = free_body(node, map);
    if (const YAML::Node node = root["contact_forces"]) read_contact_forces(node, map);
    read_deviations(root["deviations"], map);
    return map;
  }

 private:
  /// Rows of states before and velocities after.
  ColumnMap read_impacts(const YAML::Node& root) const {
    check_keys(root, {"columns", "after", "skip", "names", "topic", "rows"});
    ColumnMap map;
    map.rate = 1.0;
    map.table = table_options(root);
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

  /// The word of this key; without one the first.
  std::string one_of(const YAML::Node& root, const char* key,
                     const std::array<const char*, 2>& words) const {
    const YAML::Node node = root[key];
    if (!node) return words[0];
    std::string text = scalar(node, key);
    if (text != words[0] && text != words[1])
      fail(node, fmt::format("{}: '{}'; expected {} or {}", key, text, words[0], words[1]));
    return text;
  }

  TableOptions table_options(const YAML::Node& root) const {
    TableOptions options;
    if (const YAML::Node node = root["names"]) {
      if (!node.IsSequence() || node.size() == 0)
        fail(node,
             "names: expected a list: the columns of a CSV file without a header, from the first "
             "on");
      for (const auto& name : node) options.names.push_back(scalar(name, "names"));
    }
    if (const YAML::Node node = root["topic"]) options.topic = scalar(node, "topic");
    if (const YAML::Node node = root["rows"]) {
      if (!node.IsMap())
        fail(node, "rows: expected a map from columns to the text of the rows to read");
      refuse_repeated_keys(node);
      for (const auto& pair : node)
        options.rows[scalar(pair.first, "rows")] = scalar(pair.second, "rows");
    }
    return options;
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

  /// A column, {column, scale, offset}, or a list of these, to be added: seconds and nanoseconds in
  /// two columns.
  void read_time(const YAML::Node& root, ColumnMap& map) const {
    const YAML::Node time = root["time"];
    if (static_cast<bool>(root["rate"]) == static_cast<bool>(time)) {
      fail(root, "expected either 'rate' (rows per second) or 'time' (the column of the time)");
    }
    if (root["rate"]) map.rate = positive(root["rate"], "rate");
    if (!time) return;
    if (time.IsSequence())
      for (const auto& part : time) map.time.push_back(source(part, "time"));
    else
      map.time.push_back(source(time, "time"));
    if (map.time.empty() || std::any_of(map.time.begin(), map.time.end(),
                                        [](const auto& s) { return s.column.empty(); }))
      fail(time, "time: expected a column, {column: C, scale: S}, or a list of these, to be added");
    map.time_unit_given = !time.IsScalar();
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

  /// NAME: {links: [LINK, ...], x: COLUMN, y: COLUMN, z: COLUMN}.
  void read_contact_forces(const YAML::Node& node, ColumnMap& map) const {
    if (!node.IsMap()) fail(node, "contact_forces: expected a map from names to links and columns");
    refuse_repeated_keys(node);
    for (const auto& pair : node) {
      ColumnMap::ContactForce& force = map.contact_forces.emplace_back();
      force.name = scalar(pair.first, "contact_forces");
      const YAML::Node value = pair.second;
      check_keys(value, {"links", "x", "y", "z"});
      if (!value["links"] || !value["links"].IsSequence() || value["links"].size() == 0)
        fail(value, force.name + ": expected 'links', a list of the links that the force acts on");
      for (const auto& link : value["links"]) force.bodies.push_back(body_of(link));
      for (const char* axis : {"x", "y", "z"})
        force.components.push_back(value[axis] ? source(value[axis], force.name)
                                               : ColumnSource{});
    }
  }

  int body_of(const YAML::Node& node) const {
    const std::string link = scalar(node, "links");
    const int frame = model_.find_frame(link);
    if (frame < 0) {
      std::vector<std::string> links;
      for (const Frame& one : model_.frames()) links.push_back(one.name);
      fail(node, fmt::format("'{}' is no link of this scene; there are: {}", link,
                             fmt::join(links, ", ")));
    }
    return model_.frames()[static_cast<std::size_t>(frame)].body;
  }

  /// Position or force: standard deviation. Of an orientation any component stands for its three
  /// angles.
  void read_deviations(const YAML::Node& node, ColumnMap& map) const {
    using Kind = ColumnMap::Entry::Kind;
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    map.position_deviation = VectorX::Constant(model_.nv(), kUnknown);
    map.force_deviation = map.position_deviation;
    if (!node) return;
    if (!node.IsMap()) fail(node, "deviations: expected a map from columns to standard deviations");
    refuse_repeated_keys(node);
    for (const auto& pair : node) {
      const ColumnMap::Entry named = entry(pair.first, pair.second);
      const double deviation = positive(pair.second, named.name);
      if (named.kind == Kind::kVelocity)
        fail(pair.first, fmt::format("deviations: '{}' is a velocity; positions and applied forces "
                                     "have deviations", named.name));
      if (named.kind == Kind::kForce) {
        map.force_deviation[named.index] = deviation;
        continue;
      }
      for (int b = 1; b < model_.num_bodies(); ++b) {
        const Body& body = model_.body(b);
        const int k = named.index - body.q_index, nv = joint_nv(body.joint_type);
        if (k < 0 || k >= joint_nq(body.joint_type)) continue;
        const int linear = joint_num_linear(body.joint_type);
        if (joint_nq(body.joint_type) == nv || k < linear)
          map.position_deviation[body.v_index + k] = deviation;
        else
          map.position_deviation.segment(body.v_index + linear, nv - linear).setConstant(deviation);
      }
    }
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

}  // namespace

ColumnMap load_column_map(const std::filesystem::path& file, const Model& model) {
  return MapReader(file, model).read();
}

}  // namespace counterpoint::estimation
