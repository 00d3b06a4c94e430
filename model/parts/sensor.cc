#include "counterpoint/model/parts/sensor.h"

#include "counterpoint/model/model.h"

namespace counterpoint {
namespace {

/// Name, unit and suffixes of a kind; those of joints depend on the joint.
struct KindWords {
  const char* name;
  const char* unit;
  std::vector<const char*> suffixes;
};

const KindWords& words(SensorKind kind) {
  static const KindWords kWords[kNumSensorKinds] = {
      {"position", "m", {"x", "y", "z"}},
      {"orientation", "1", {"qw", "qx", "qy", "qz"}},
      {"linear_velocity", "m/s", {"vx", "vy", "vz"}},
      {"angular_velocity", "rad/s", {"wx", "wy", "wz"}},
      {"linear_acceleration", "m/s^2", {"ax", "ay", "az"}},
      {"angular_acceleration", "rad/s^2", {"dwx", "dwy", "dwz"}},
      {"specific_force", "m/s^2", {"ax", "ay", "az"}},
      {"force", "N", {"fx", "fy", "fz"}},
      {"torque", "N m", {"tx", "ty", "tz"}},
      {"contact_force", "N", {"fx", "fy", "fz"}},
      {"joint_position", "", {}},
      {"joint_velocity", "", {}},
      {"joint_effort", "", {}},
      {"range", "m", {"range"}},
      {"center_of_mass", "m", {"x", "y", "z"}},
      {"center_of_mass_velocity", "m/s", {"vx", "vy", "vz"}},
      {"linear_momentum", "kg m/s", {"px", "py", "pz"}},
      {"angular_momentum", "kg m^2/s", {"lx", "ly", "lz"}},
      {"touch", "N", {"touch"}},
      {"pressure", "Pa", {"pressure"}},
      {"tendon_length", "m|rad", {"length"}},
      {"tendon_velocity", "m/s|rad/s", {"speed"}},
      {"tendon_force", "N|N m", {"force"}},
      {"actuator_position", "m|rad", {"position"}},
      {"actuator_velocity", "m/s|rad/s", {"speed"}},
      {"actuator_force", "N|N m", {"force"}}};
  return kWords[static_cast<int>(kind)];
}

/// Adds the coordinates of a joint, linear ones before angular ones; of a quaternion four.
void add_joint_rows(SensorKind kind, JointType type, std::vector<SensorRow>& rows) {
  const JointSuffixes suffixes = joint_suffixes(type);
  const bool position = kind == SensorKind::kJointPosition;
  const bool effort = kind == SensorKind::kJointEffort;
  const char* linear = position ? "m" : effort ? "N" : "m/s";
  const char* angular = position ? "rad" : effort ? "N m" : "rad/s";
  if (position && joint_nq(type) > joint_nv(type)) angular = "1";
  int left = joint_num_linear(type);
  for (const char* suffix : position ? suffixes.q : effort ? suffixes.force : suffixes.v)
    rows.push_back({suffix, left-- > 0 ? linear : angular});
}

}  // namespace

const char* sensor_kind_name(SensorKind kind) { return words(kind).name; }

std::vector<SensorRow> sensor_rows(const Model& model, const Sensor& sensor, SensorKind kind) {
  std::vector<SensorRow> rows;
  if (senses_joint(kind)) {
    add_joint_rows(kind, model.body(sensor.joint + 1).joint_type, rows);
  } else {
    for (const char* suffix : words(kind).suffixes) rows.push_back({suffix, words(kind).unit});
  }
  return rows;
}

std::vector<SensorRow> sensor_rows(const Model& model, const Sensor& sensor) {
  std::vector<SensorRow> rows;
  for (const SensorKind kind : sensor.kinds)
    for (SensorRow& row : sensor_rows(model, sensor, kind)) rows.push_back(std::move(row));
  return rows;
}

bool is_welded(const Model& model, int frame) {
  const Frame& link = model.frames()[static_cast<std::size_t>(frame)];
  if (link.body == 0) return true;
  return link.parent >= 0 &&
         model.frames()[static_cast<std::size_t>(link.parent)].body == link.body;
}

}  // namespace counterpoint
