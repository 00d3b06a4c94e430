#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/map_nodes.h"
#include "counterpoint/engine/estimate/sensors/sensor_map.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

class MapReader : public MapNodes {
 public:
  using MapNodes::MapNodes;

  ColumnMap read() const {
    const YAML::Node root =
        load_yaml_file(file(), "there is no such file; expected a YAML column map");
    if (root.IsMap() && root["after"]) return read_impacts(root);
    check_keys(root, {"columns",
                      "free",
                      "rate",
                      "time",
                      "substeps",
                      "velocities",
                      "average",
                      "pieces",
                      "angular_velocity",
                      "linear_velocity",
                      "names",
                      "topic",
                      "rows",
                      "after",
                      "skip",
                      "contact_forces",
                      "deviations",
                      "sensors",
                      "markers",
                      "sources",
                      "treadmill"});
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
    read_sensors(*this, root, map);
    if (root["columns"] || map.sensors.empty()) read_columns(root, map);
    if (const YAML::Node node = root["treadmill"]) map.treadmill = vector(node, "treadmill");
    if (const YAML::Node node = root["free"]) map.free_body = free_body(node, map);
    if (const YAML::Node node = root["contact_forces"]) read_contact_forces(node, map);
    read_deviations(root["deviations"], map);
    return map;
  }

 private:
  /// Reads a map of impacts: each row has the state before and the velocities after.
  ColumnMap read_impacts(const YAML::Node& root) const {
    check_keys(root, {"columns", "after", "skip", "names", "topic", "rows"});
    ColumnMap map;
    map.rate = 1.0;
    map.table = table_options(root);
    map.entries = entries(root, "columns");
    map.after = entries(root, "after");
    for (const std::vector<ColumnMap::Entry>* list : {&map.entries, &map.after})
      for (const ColumnMap::Entry& e : *list)
        if (e.kind == ColumnMap::Entry::Kind::kForce || e.kind == ColumnMap::Entry::Kind::kInput ||
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

  /// Returns the value of this key, one of `words`; the first one if the key is missing.
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

  /// Reads `columns`; recorded inputs become a list of their own.
  void read_columns(const YAML::Node& root, ColumnMap& map) const {
    for (ColumnMap::Entry& one : entries(root, "columns"))
      (one.kind == ColumnMap::Entry::Kind::kInput ? map.inputs : map.entries)
          .push_back(std::move(one));
    if (map.entries.empty() && map.sensors.empty())
      fail(root["columns"], "expected positions, velocities or forces beside the inputs");
    const auto has = [&](const std::string& name) {
      return std::any_of(map.inputs.begin(), map.inputs.end(),
                         [&](const ColumnMap::Entry& one) { return one.name == name; });
    };
    map.input_columns = find_input_columns(has, model());
    const std::vector<std::string> all = map.input_columns.names(model());
    for (ColumnMap::Entry& one : map.inputs)
      one.index = static_cast<int>(std::find(all.begin(), all.end(), one.name) - all.begin());
  }

  void read_time(const YAML::Node& root, ColumnMap& map) const {
    const YAML::Node node = root["time"];
    if (static_cast<bool>(root["rate"]) == static_cast<bool>(node)) {
      fail(root, "expected either 'rate' (rows per second) or 'time' (the column of the time)");
    }
    if (root["rate"]) map.rate = positive(root["rate"], "rate");
    if (!node) return;
    map.time = time(node);
    map.time_unit_given = !node.IsScalar();
  }

  ColumnMap::Entry entry(const YAML::Node& key, const YAML::Node& value) const {
    using Kind = ColumnMap::Entry::Kind;
    const std::string name = scalar(key, "columns");
    for (const auto& [kind, list] :
         {std::pair{Kind::kPosition, &names().q}, std::pair{Kind::kVelocity, &names().v},
          std::pair{Kind::kForce, &names().force}}) {
      const auto it = std::find(list->begin(), list->end(), name);
      if (it != list->end()) {
        return {kind, static_cast<int>(it - list->begin()), name, source(value, name)};
      }
    }
    if (is_input_column(model(), name)) return {Kind::kInput, -1, name, source(value, name)};
    fail(key, fmt::format("'{}' is no coordinate of this scene; there are: {}{}", name,
                          fmt::join(names().q, ", "), inputs_in_words()));
  }

  std::string inputs_in_words() const {
    const std::vector<std::string> all = InputColumns::of(model()).names(model());
    return all.empty() ? "" : fmt::format("; inputs: {}", fmt::join(all, ", "));
  }

  /// NAME: {links: [LINK, ...], x: COLUMN, y: COLUMN, z: COLUMN}.
  void read_contact_forces(const YAML::Node& node, ColumnMap& map) const {
    if (!node.IsMap()) fail(node, "contact_forces: expected a map from names to links and columns");
    refuse_repeated_keys(node);
    for (const auto& pair : node) {
      ColumnMap::ContactForce& force = map.contact_forces.emplace_back();
      force.name = scalar(pair.first, "contact_forces");
      const YAML::Node value = pair.second;
      check_keys(value, {"links", "x", "y", "z", "source"});
      if (!value["links"] || !value["links"].IsSequence() || value["links"].size() == 0)
        fail(value, force.name + ": expected 'links', a list of the links that the force acts on");
      for (const auto& one : value["links"]) force.bodies.push_back(link(one).body);
      force.source = source_name(*this, value["source"], map);
      for (const char* axis : {"x", "y", "z"})
        force.components.push_back(value[axis] ? source(value[axis], force.name) : ColumnSource{});
    }
  }

  /// Reads standard deviations of positions and forces. Any component of an orientation sets the
  /// deviation of its three angles.
  void read_deviations(const YAML::Node& node, ColumnMap& map) const {
    using Kind = ColumnMap::Entry::Kind;
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    map.position_deviation = VectorX::Constant(model().nv(), kUnknown);
    map.force_deviation = map.position_deviation;
    if (!node) return;
    if (!node.IsMap()) fail(node, "deviations: expected a map from columns to standard deviations");
    refuse_repeated_keys(node);
    for (const auto& pair : node) {
      const ColumnMap::Entry named = entry(pair.first, pair.second);
      const double deviation = positive(pair.second, named.name);
      if (named.kind == Kind::kVelocity || named.kind == Kind::kInput)
        fail(pair.first,
             fmt::format("deviations: '{}' is {}; positions and applied forces have "
                         "deviations",
                         named.name, named.kind == Kind::kInput ? "an input" : "a velocity"));
      if (named.kind == Kind::kForce) {
        map.force_deviation[named.index] = deviation;
        continue;
      }
      for (int b = 1; b < model().num_bodies(); ++b) {
        const Body& body = model().body(b);
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
    const std::string name = scalar(node, "free");
    for (int i = 1; i < model().num_bodies(); ++i) {
      if (model().joint(i - 1).link != name) continue;
      const Body& body = model().body(i);
      if (body.joint_type != JointType::kFloating) break;
      for (int k = body.q_index; k < body.q_index + 7; ++k) {
        const bool mapped = std::any_of(map.entries.begin(), map.entries.end(), [&](const auto& e) {
          return e.kind == ColumnMap::Entry::Kind::kPosition && e.index == k;
        });
        if (!mapped) fail(node, fmt::format("free: 'columns' says nothing about {}", names().q[k]));
      }
      return i;
    }
    fail(node, fmt::format("free: '{}' is no floating link of this scene", name));
  }
};

}  // namespace

ColumnMap load_column_map(const std::filesystem::path& file, const Model& model) {
  return MapReader(file, model).read();
}

}  // namespace counterpoint::estimation
