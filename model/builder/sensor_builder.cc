// Sensors: the part of ModelBuilder that finds their links and joints, and checks them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/builder/robot_tree.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

std::string sensor_at(const SensorSpec& spec) {
  return located_at(spec.where, "sensor '" + spec.sensor.name + "'");
}

[[noreturn]] void fail_sensor(const SensorSpec& spec, const std::string& what) {
  throw InputError(sensor_at(spec) + ": " + what);
}

bool all_kinds(const Sensor& sensor, bool (*test)(SensorKind)) {
  return std::all_of(sensor.kinds.begin(), sensor.kinds.end(), test);
}
bool any_kind(const Sensor& sensor, bool (*test)(SensorKind)) {
  return std::any_of(sensor.kinds.begin(), sensor.kinds.end(), test);
}

/// Numbers of rows of the quantities of a sensor.
std::vector<std::size_t> rows_by_kind(const Model& model, const Sensor& sensor) {
  std::vector<std::size_t> rows;
  for (const SensorKind kind : sensor.kinds)
    rows.push_back(sensor_rows(model, sensor, kind).size());
  return rows;
}

/// Checks one list of errors and gives it one number a row: from one number, one for each quantity,
/// or one for each row.
void spread_errors(const SensorSpec& spec, const char* key, const std::vector<std::size_t>& rows,
                   std::vector<double>& values) {
  if (values.empty()) return;
  const std::size_t all = std::accumulate(rows.begin(), rows.end(), std::size_t{0});
  if (values.size() == 1) {
    values.assign(all, values.front());
  } else if (values.size() == rows.size() && all != rows.size()) {
    const std::vector<double> given = std::exchange(values, {});
    for (std::size_t i = 0; i < rows.size(); ++i) values.insert(values.end(), rows[i], given[i]);
  }
  if (values.size() != all)
    fail_sensor(spec, fmt::format("{} has {} numbers; one is expected, or one for each of its {} "
                                  "columns{}",
                                  key, values.size(), all,
                                  rows.size() > 1 ? ", or one for each of its vectors" : ""));
  const bool is_bias = std::string_view(key) == "bias";
  for (const double x : values)
    if (!std::isfinite(x) || (x < 0.0 && !is_bias))
      fail_sensor(spec, fmt::format("{} is {}; it must be finite{}", key, x,
                                    is_bias ? "" : " and not negative"));
}

void check_errors(const SensorSpec& spec, const std::vector<std::size_t>& rows,
                  SensorErrors& errors) {
  spread_errors(spec, "bias", rows, errors.bias);
  spread_errors(spec, "noise", rows, errors.noise);
  spread_errors(spec, "quantum", rows, errors.quantum);
  if (!std::isfinite(errors.rate) || errors.rate < 0.0)
    fail_sensor(spec, fmt::format("rate is {} Hz; it must be finite and positive", errors.rate));
  if (!std::isfinite(errors.delay) || errors.delay < 0.0)
    fail_sensor(spec,
                fmt::format("delay is {} s; it must be finite and not negative", errors.delay));
}

template <class Part>
NameIndex indices_by_name(const std::vector<Part>& parts) {
  NameIndex indices;
  for (const Part& part : parts) indices[part.name] = static_cast<int>(indices.size());
  return indices;
}

/// Refuses wrenches between parts of a body on which forces act that are known for the whole body
/// only.
void check_weld(const SensorSpec& spec, const Model& model, int frame) {
  const auto& links = model.frames();
  const int body = links[static_cast<std::size_t>(frame)].body;
  if (!is_welded(model, frame)) return;
  const auto here = [&](const auto& force) { return body != 0 && force.body == body; };
  const auto& drags = model.drags();
  const auto& carried = model.gravity_compensations();
  const char* what = std::any_of(drags.begin(), drags.end(), here) ? "drag" : "";
  if (std::any_of(carried.begin(), carried.end(), here)) what = "gravity compensation";
  for (const Tendon& tendon : model.tendons())
    if (path_bodies(tendon).count(body) > 0) what = "a tendon";
  if (*what != '\0')
    fail_sensor(spec,
                fmt::format("link '{}' is welded to others, and {} acts on them, which is known "
                            "for all of them together only: take a link held by a joint that "
                            "moves, or leave the sensor out",
                            links[static_cast<std::size_t>(frame)].name, what));
}

/// Refuses a wrench relative to a link other than the one that the sensor's link hangs on, which
/// may consist of links welded together.
void check_above(const SensorSpec& spec, const Model& model, const Sensor& sensor) {
  const auto parent = [&](int frame) {
    return model.frames()[static_cast<std::size_t>(frame)].parent;
  };
  int above = parent(sensor.frame);
  while (above >= 0 && above != sensor.reference && is_welded(model, above)) above = parent(above);
  if (above < 0 || above != sensor.reference)
    fail_sensor(spec, fmt::format("'{}' is not the link that the sensor's link hangs on; a wrench "
                                  "relative to that is the one on it",
                                  spec.relative_to));
}

}  // namespace

/// Returns the frame of a link; -1 for "world", unless a link has this name.
int ModelBuilder::find_sensor_link(const SensorSpec& spec, const std::string& link) const {
  const auto found = frame_names_.find(link);
  if (found != frame_names_.end()) return found->second;
  if (link == "world") return -1;
  std::string nearest;
  int least = 0;
  for (const auto& [name, index] : frame_names_) {
    const int distance = edit_distance(link, name);
    if (!nearest.empty() && distance >= least) continue;
    nearest = name;
    least = distance;
  }
  fail_sensor(spec, fmt::format("there is no link '{}'; links: {}{}", link, listed(frame_names_),
                                nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
}

/// Finds the joint, tendon or actuator that all kinds of a sensor concern.
void ModelBuilder::find_sensed_part(const SensorSpec& spec, Sensor& sensor) const {
  const auto find = [&](const char* part, const std::string& name, const auto& names) {
    if (!spec.link.empty())
      fail_sensor(spec, fmt::format("it reads a {0}: give {0} in place of link", part));
    const auto found = names.find(name);
    if (found == names.end())
      fail_sensor(spec, fmt::format("there is no {0} '{1}'; {0}s: {2}", part, name, listed(names)));
    return found->second;
  };
  if (all_kinds(sensor, senses_joint))
    sensor.joint = find("joint", spec.joint, joint_names_);
  else if (all_kinds(sensor, senses_tendon))
    sensor.tendon = find("tendon", spec.tendon, indices_by_name(model_.tendons_));
  else if (all_kinds(sensor, senses_actuator))
    sensor.actuator = find("actuator", spec.actuator, indices_by_name(model_.actuators_));
  else
    fail_sensor(spec, "quantities of joints, tendons, actuators and links do not mix in a sensor");
  if (sensor.actuator < 0) return;
  const Actuator& a = model_.actuators_[static_cast<std::size_t>(sensor.actuator)];
  const auto moves = [](SensorKind kind) { return kind != SensorKind::kActuatorForce; };
  if (a.joint < 0 && a.tendon < 0 && any_kind(sensor, moves))
    fail_sensor(spec, "an actuator on a link has no position or velocity; take those of the link");
}

/// Finds the geometries whose contacts a sensor sums.
void ModelBuilder::find_sensed_contacts(const SensorSpec& spec, Sensor& sensor) const {
  if (!all_kinds(sensor, senses_contacts))
    fail_sensor(spec, "quantities of contacts and of links do not mix in a sensor");
  if (spec.link.empty()) fail_sensor(spec, "it needs a link or geometry");
  sensor.geometries = geometries_named(spec.link);
  const auto found = frame_names_.find(spec.link);
  if (found != frame_names_.end()) sensor.frame = found->second;
  const bool boxed = std::isfinite(sensor.size.minCoeff());
  if ((sensor.own_axes || boxed) && sensor.frame < 0)
    fail_sensor(spec, "axes of a link are those of a moving link; give its name");
  if (any_kind(sensor, [](SensorKind kind) { return kind == SensorKind::kPressure; }) &&
      !std::isfinite(sensor.size.head<2>().maxCoeff()))
    fail_sensor(spec, "a pressure needs size: edges x, y of the area [m], z optional");
  if (boxed && any_kind(sensor, [](SensorKind k) { return k == SensorKind::kContactForce; }))
    fail_sensor(spec, "size is for touch and pressure; leave it out");
  if (!(sensor.size.array() > 0.0).all()) fail_sensor(spec, "size has to be positive");
  if (!spec.from.empty()) sensor.others = geometries_named(spec.from);
}

void ModelBuilder::find_sensed_link(const SensorSpec& spec, Sensor& sensor) const {
  if (!spec.joint.empty()) {
    const auto found = joint_names_.find(spec.joint);
    if (found == joint_names_.end() || !all_kinds(sensor, senses_wrench) || !spec.link.empty())
      fail_sensor(spec, fmt::format("joint '{}': a wrench takes a joint that moves, and no link; "
                                    "other kinds take a link; joints: {}",
                                    spec.joint, listed(joint_names_)));
    sensor.frame = frame_names_.at(model_.joints_[found->second].link);
  } else if (!spec.link.empty()) {
    sensor.frame = find_sensor_link(spec, spec.link);
  } else if (!all_kinds(sensor, senses_subtree)) {
    fail_sensor(spec, "it needs a link");
  }
  if (any_kind(sensor, senses_wrench)) {
    if (sensor.frame < 0) fail_sensor(spec, "the world hangs on nothing; give a link");
    check_weld(spec, model_, sensor.frame);
  }
}

void ModelBuilder::add_sensor(const SensorSpec& spec) {
  Sensor sensor = spec.sensor;
  if (sensor.name.empty()) fail_sensor(spec, "a sensor needs a name");
  if (sensor.kinds.empty()) fail_sensor(spec, "it reads nothing; give it one kind at least");
  for (const Sensor& other : model_.sensors_)
    if (other.name == sensor.name) fail_sensor(spec, "there is already a sensor of this name");
  check_pose(sensor.X_FS, sensor_at(spec));
  if (any_kind(sensor, senses_part)) {
    find_sensed_part(spec, sensor);
  } else if (any_kind(sensor, senses_contacts)) {
    find_sensed_contacts(spec, sensor);
  } else {
    find_sensed_link(spec, sensor);
  }
  if (!spec.from.empty() && sensor.geometries.empty())
    fail_sensor(spec, "`from` is for a contact force between two links or geometries");
  if (!spec.relative_to.empty()) {
    const bool wrench = all_kinds(sensor, senses_wrench);
    if (!wrench && (!all_kinds(sensor, takes_reference) || sensor.own_axes))
      fail_sensor(spec,
                  "relative_to is for positions, orientations and velocities, whose vectors are "
                  "along the axes of that link, and for wrenches");
    sensor.reference = find_sensor_link(spec, spec.relative_to);
    if (wrench) check_above(spec, model_, sensor);
  }
  if (sensor.own_axes && !all_kinds(sensor, takes_axes))
    fail_sensor(spec, "its values have no choice of axes; leave it out");
  if (!(sensor.limit > 0.0))
    fail_sensor(spec, fmt::format("the limit is {} m; it must be positive", sensor.limit));
  check_errors(spec, rows_by_kind(model_, sensor), sensor.errors);
  model_.sensors_.push_back(std::move(sensor));
}

}  // namespace counterpoint
