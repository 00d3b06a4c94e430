#include "counterpoint/engine/estimate/sensors/sensor_map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "counterpoint/engine/io/marker_columns.h"

namespace counterpoint::estimation {
namespace {

/// Standard deviation of an unknown delay [s].
constexpr double kDelayDeviation = 0.05;

/// Kind name in column maps, and the internal sensors that it consists of.
struct NamedKind {
  const char* name;
  std::vector<SensorKind> parts;
};

/// Kinds by the names of column maps, and by those that sensors of scenes have.
const std::array<NamedKind, 16>& named_kinds() {
  using Kind = SensorKind;
  static const std::array<NamedKind, 16> kinds = {{
      {"point", {Kind::kPoint}},
      {"orientation", {Kind::kOrientation}},
      {"pose", {Kind::kPoint, Kind::kOrientation}},
      {"angular_velocity", {Kind::kAngularVelocity}},
      {"specific_force", {Kind::kSpecificForce}},
      {"imu", {Kind::kAngularVelocity, Kind::kSpecificForce}},
      {"coordinate", {Kind::kCoordinate}},
      {"contact_force", {Kind::kContactForce}},
      {"joint_force", {Kind::kJointForce}},
      {"wrench", {Kind::kLinkForce, Kind::kLinkTorque}},
      {"position", {Kind::kPoint}},
      {"link_pose", {Kind::kPoint, Kind::kOrientation}},
      {"gyro", {Kind::kAngularVelocity}},
      {"accelerometer", {Kind::kSpecificForce}},
      {"joint_position", {Kind::kCoordinate}},
      {"joint_effort", {Kind::kJointForce}},
  }};
  return kinds;
}

class SensorReader {
 public:
  SensorReader(const MapNodes& nodes, ColumnMap& map) : nodes_(nodes), map_(map) {}

  void read_sources(const YAML::Node& node) {
    expect_map(node, "sources");
    for (const auto& pair : node) {
      SensorSource& source = map_.sources.emplace_back();
      source.name = nodes_.scalar(pair.first, "sources");
      const YAML::Node value = pair.second;
      nodes_.check_keys(value, {"time", "rate", "delay"});
      if (static_cast<bool>(value["rate"]) == static_cast<bool>(value["time"]))
        nodes_.fail(value, source.name +
                               ": expected either 'rate' (rows per second) or 'time' (the "
                               "column of the time)");
      if (value["rate"]) source.rate = nodes_.positive(value["rate"], "rate");
      if (value["time"]) source.time = nodes_.time(value["time"]);
      source.time_unit_given = value["time"] && !value["time"].IsScalar();
      const YAML::Node delay = value["delay"];
      if (!delay) continue;
      if (delay.IsScalar() && delay.Scalar() == "unknown")
        source.delay_deviation = kDelayDeviation;
      else
        source.delay = nodes_.number(delay, source.name + ".delay");
    }
  }

  void read_sensors(const YAML::Node& node) {
    expect_map(node, "sensors");
    for (const auto& pair : node) read_sensor(nodes_.scalar(pair.first, "sensors"), pair.second);
  }

  /// Reads points on links from a table with the columns marker, link, x, y, z.
  void read_markers(const YAML::Node& node) {
    nodes_.check_keys(node, {"table", "axes", "scale", "deviation", "source"});
    if (!node["table"])
      nodes_.fail(node, "markers: expected 'table', a file with the columns marker, link, x, y, z");
    const WorldAxes axes = axes_of(node["axes"]);
    const double scale = node["scale"] ? nodes_.positive(node["scale"], "scale") : 1.0;
    Sensor shared;
    shared.source = source_name(nodes_, node["source"], map_);
    if (node["deviation"]) shared.deviation = nodes_.positive(node["deviation"], "deviation");
    const std::filesystem::path file = std::filesystem::path(nodes_.file()).parent_path() /
                                       nodes_.scalar(node["table"], "markers.table");
    for (const MarkerPlace& place : read_marker_places(file)) {
      Sensor& marker = map_.sensors.emplace_back(shared);
      marker.name = place.marker;
      const int frame = nodes_.model().find_frame(place.link);
      if (frame < 0)
        throw InputError(
            fmt::format("{}: '{}' is no link of this scene; expected one of those that "
                        "`inspect` lists",
                        place.where, place.link));
      attach(nodes_.model().frames()[static_cast<std::size_t>(frame)], place.point, marker);
      for (const auto& [axis, sign] : axes)
        marker.columns.push_back({fmt::format("{}.{}", marker.name, axis), sign * scale, 0.0});
    }
  }

 private:
  void expect_map(const YAML::Node& node, const char* key) const {
    if (!node.IsMap() || node.size() == 0)
      nodes_.fail(node, fmt::format("{}: expected a map from names to what they are", key));
    nodes_.refuse_repeated_keys(node);
  }

  static void attach(const Frame& frame, const Vector3& point, Sensor& sensor) {
    sensor.body = frame.body;
    sensor.point = frame.X_BF * point;
    sensor.axes = frame.X_BF.rotation;
  }

  /// Reads the world axes in terms of the file's axes; by default they are the same.
  WorldAxes axes_of(const YAML::Node& node) const {
    std::vector<std::string> names;
    if (node && node.IsSequence())
      for (const YAML::Node& axis : node) names.push_back(nodes_.scalar(axis, "axes"));
    const auto axes = world_axes(node ? names : std::vector<std::string>{"x", "y", "z"});
    if (!axes) nodes_.fail(node, kAxesExpected);
    return *axes;
  }

  const NamedKind& kind_of(const std::string& name, const YAML::Node& node) const {
    std::vector<std::string> known;
    const std::string kind = node["kind"] ? nodes_.scalar(node["kind"], "kind") : "";
    for (const NamedKind& one : named_kinds()) {
      if (kind == one.name) return one;
      known.push_back(one.name);
    }
    nodes_.fail(
        node, fmt::format("{}: kind '{}'; expected one of {}", name, kind, fmt::join(known, ", ")));
  }

  void read_sensor(const std::string& name, const YAML::Node& node) {
    if (!node.IsMap()) nodes_.fail(node, name + ": expected {kind: ..., link: ..., columns: ...}");
    if (!node["kind"]) return read_scene_sensor(name, node);
    nodes_.check_keys(node, {"kind", "link", "links", "coordinate", "position", "rotation",
                             "columns", "source", "deviation", "offset", "scale", "placement"});
    const NamedKind& kind = kind_of(name, node);
    Sensor shared;
    shared.name = name;
    shared.source = source_name(nodes_, node["source"], map_);
    for (const SensorKind part : kind.parts) read_unknowns(node, part, shared);
    read_place(node, kind, shared);
    std::size_t next = 0, size = 0;
    for (const SensorKind part : kind.parts) size += static_cast<std::size_t>(reading_size(part));
    const std::vector<double> deviations = read_deviations(node["deviation"], kind.parts.size());
    const std::vector<ColumnSource> columns = read_columns(node, name, size);
    for (std::size_t i = 0; i < kind.parts.size(); ++i) {
      Sensor& sensor = map_.sensors.emplace_back(shared);
      sensor.kind = kind.parts[i];
      if (!deviations.empty()) sensor.deviation = deviations[i];
      for (int k = 0; k < reading_size(sensor.kind); ++k) sensor.columns.push_back(columns[next++]);
    }
  }

  /// Reads a sensor of the scene of this name, whose columns have its names unless they are given.
  void read_scene_sensor(const std::string& name, const YAML::Node& node) {
    nodes_.check_keys(node, {"columns", "source", "deviation", "offset", "scale", "placement"});
    const auto& all = nodes_.model().sensors();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
    if (found == all.end())
      nodes_.fail(node, fmt::format("{}: expected 'kind', or the name of a sensor of the scene; "
                                    "`inspect` lists them",
                                    name));
    std::vector<Sensor> parts =
        scene_measurements(nodes_.model(), static_cast<int>(found - all.begin()));
    std::vector<ColumnSource> columns;
    for (const Sensor& part : parts)
      columns.insert(columns.end(), part.columns.begin(), part.columns.end());
    if (node["columns"]) columns = read_columns(node, name, columns.size());
    const std::vector<double> deviations = read_deviations(node["deviation"], parts.size());
    std::size_t next = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      Sensor& part = parts[i];
      for (ColumnSource& column : part.columns) column = columns[next++];
      part.source = source_name(nodes_, node["source"], map_);
      read_unknowns(node, part.kind, part);
      if (!deviations.empty()) part.deviation = deviations[i];
      map_.sensors.push_back(part);
    }
  }

  /// Reads whether a constant of the readings is unknown.
  bool is_unknown(const YAML::Node& entry, const char* key) const {
    const YAML::Node node = entry[key];
    if (!node) return false;
    const std::string text = nodes_.scalar(node, key);
    if (text != "unknown" && text != "none")
      nodes_.fail(node, fmt::format("{}: '{}'; expected unknown or none", key, text));
    return text == "unknown";
  }

  /// Reads which constants of a part of a sensor are unknown.
  void read_unknowns(const YAML::Node& entry, SensorKind kind, Sensor& sensor) const {
    sensor.has_offset = is_unknown(entry, "offset");
    sensor.has_scale = is_unknown(entry, "scale");
    sensor.has_placement = is_unknown(entry, "placement");
    if ((sensor.has_offset || sensor.has_scale) && kind == SensorKind::kOrientation)
      nodes_.fail(entry,
                  "offset, scale: an orientation has none; 'placement: unknown' finds how "
                  "its axes are turned");
    if (sensor.has_placement &&
        (kind == SensorKind::kCoordinate || kind == SensorKind::kJointForce ||
         kind == SensorKind::kContactForce))
      nodes_.fail(entry, "placement: what this sensor reads does not depend on where it is");
  }

  void read_place(const YAML::Node& node, const NamedKind& kind, Sensor& sensor) const {
    const SensorKind first = kind.parts.front();
    const auto need = [&](const char* key, const char* what) {
      if (!node[key])
        nodes_.fail(node, fmt::format("{}: expected '{}', {}", sensor.name, key, what));
      return node[key];
    };
    if (first == SensorKind::kCoordinate || first == SensorKind::kJointForce) {
      const bool force = first == SensorKind::kJointForce;
      set_coordinate(need("coordinate", force ? "as JOINT.u" : "as JOINT.q"), force, sensor);
      return;
    }
    if (first == SensorKind::kContactForce) {
      const YAML::Node links = need("links", "a list of the links that the force acts on");
      if (!links.IsSequence() || links.size() == 0)
        nodes_.fail(links, "links: expected a list of links");
      for (const auto& one : links) sensor.bodies.push_back(nodes_.link(one).body);
      return;
    }
    const Vector3 position =
        node["position"] ? nodes_.vector(node["position"], "position") : Vector3(Vector3::Zero());
    attach(nodes_.link(need("link", "the link that it is on")), position, sensor);
    if (first == SensorKind::kLinkForce && sensor.body == 0)
      nodes_.fail(node["link"], "wrench: no joint moves this link; expected a link behind one");
    if (!node["rotation"]) return;
    const Vector3 rpy = nodes_.vector(node["rotation"], "rotation");
    sensor.axes = sensor.axes * rotation_from_rpy(rpy.x(), rpy.y(), rpy.z());
  }

  void set_coordinate(const YAML::Node& node, bool force, Sensor& sensor) const {
    const std::string name = nodes_.scalar(node, "coordinate");
    const auto& all = force ? nodes_.names().force : nodes_.names().q;
    const auto at = static_cast<int>(std::find(all.begin(), all.end(), name) - all.begin());
    for (const Body& body : nodes_.model().bodies())
      if (joint_nv(body.joint_type) == 1 && joint_nq(body.joint_type) == 1 &&
          (force ? body.v_index : body.q_index) == at) {
        sensor.coordinate = body.v_index;
        sensor.position = body.q_index;
        return;
      }
    nodes_.fail(
        node, fmt::format("coordinate: '{}' is no joint of one coordinate; expected JOINT.{}", name,
                          force ? "u" : "q"));
  }

  /// Reads one value for each part of a sensor.
  std::vector<double> read_deviations(const YAML::Node& node, std::size_t parts) const {
    std::vector<double> out;
    if (!node) return out;
    if (node.IsSequence())
      for (const auto& one : node) out.push_back(nodes_.positive(one, "deviation"));
    else
      out.push_back(nodes_.positive(node, "deviation"));
    if (out.size() != parts)
      nodes_.fail(node, fmt::format("deviation: expected {}",
                                    parts == 1 ? "one number" : "a list of two numbers"));
    return out;
  }

  std::vector<ColumnSource> read_columns(const YAML::Node& node, const std::string& name,
                                         std::size_t size) const {
    const YAML::Node columns = node["columns"];
    if (!columns || !columns.IsSequence() || columns.size() != size)
      nodes_.fail(node, fmt::format("{}: expected 'columns', a list of {}", name, size));
    std::vector<ColumnSource> out;
    for (const auto& one : columns) {
      out.push_back(nodes_.source(one, name));
      if (out.back().column.empty()) nodes_.fail(one, name + ": expected the name of a column");
    }
    return out;
  }

  const MapNodes& nodes_;
  ColumnMap& map_;
};

}  // namespace

std::string source_name(const MapNodes& nodes, const YAML::Node& node, const ColumnMap& map) {
  if (!node) return {};
  const std::string name = nodes.scalar(node, "source");
  if (std::none_of(map.sources.begin(), map.sources.end(),
                   [&](const SensorSource& one) { return one.name == name; }))
    nodes.fail(node, fmt::format("source: '{}' is not among 'sources'", name));
  return name;
}

void read_sensors(const MapNodes& nodes, const YAML::Node& root, ColumnMap& map) {
  SensorReader reader(nodes, map);
  if (root["sources"]) reader.read_sources(root["sources"]);
  if (root["sensors"]) reader.read_sensors(root["sensors"]);
  if (root["markers"]) reader.read_markers(root["markers"]);
}

}  // namespace counterpoint::estimation
