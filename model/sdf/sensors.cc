#include "counterpoint/model/sdf/sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <sdf/Imu.hh>
#include <sdf/Lidar.hh>
#include <sdf/Noise.hh>

namespace counterpoint::sdf_file {
namespace {

SensorSpec named(const Document& document, const sdf::Sensor& in, const std::string& owner,
                 std::vector<SensorKind> kinds) {
  SensorSpec spec;
  spec.where = document.where(in.Element());
  spec.sensor.name = owner + "/" + in.Name();
  spec.sensor.kinds = std::move(kinds);
  spec.sensor.errors.rate = std::max(in.UpdateRate(), 0.0);
  return spec;
}

/// Sets the errors of the columns, in order, unless none has any.
void read_noise(Document& document, const sdf::ElementPtr& element,
                const std::vector<const sdf::Noise*>& columns, SensorErrors& errors) {
  const auto none = [](const sdf::Noise* n) { return n->Type() == sdf::NoiseType::NONE; };
  if (std::all_of(columns.begin(), columns.end(), none)) return;
  for (const sdf::Noise* noise : columns) {
    const bool rounded = noise->Type() == sdf::NoiseType::GAUSSIAN_QUANTIZED;
    errors.noise.push_back(none(noise) ? 0.0 : noise->StdDev());
    errors.bias.push_back(none(noise) ? 0.0 : noise->Mean());
    errors.quantum.push_back(rounded ? noise->Precision() : 0.0);
    if (!none(noise) && (noise->BiasMean() != 0.0 || noise->BiasStdDev() != 0.0 ||
                         noise->DynamicBiasStdDev() != 0.0))
      document.note(element, "a bias that differs from run to run is not used");
  }
  const auto zero = [](double quantum) { return quantum == 0.0; };
  if (std::all_of(errors.quantum.begin(), errors.quantum.end(), zero)) errors.quantum.clear();
}

void read_imu(Document& document, const sdf::Sensor& in, SensorSpec spec,
              std::vector<SensorSpec>& out) {
  const sdf::Imu& imu = *in.ImuSensor();
  spec.sensor.kinds = {SensorKind::kSpecificForce, SensorKind::kAngularVelocity};
  spec.sensor.own_axes = true;
  read_noise(document, in.Element(),
             {&imu.LinearAccelerationXNoise(), &imu.LinearAccelerationYNoise(),
              &imu.LinearAccelerationZNoise(), &imu.AngularVelocityXNoise(),
              &imu.AngularVelocityYNoise(), &imu.AngularVelocityZNoise()},
             spec.sensor.errors);
  out.push_back(std::move(spec));
}

/// Reads a lidar of one ray, whose angles are about z and then about -y of the sensor.
void read_lidar(Document& document, const sdf::Sensor& in, SensorSpec spec,
                std::vector<SensorSpec>& out) {
  const sdf::ElementPtr element = in.Element();
  const sdf::Lidar& lidar = *in.LidarSensor();
  const double yaw = lidar.HorizontalScanMinAngle().Radian(),
               pitch = lidar.VerticalScanMinAngle().Radian();
  const unsigned rays = lidar.HorizontalScanSamples() * lidar.VerticalScanSamples();
  if (rays != 1 || yaw != lidar.HorizontalScanMaxAngle().Radian() ||
      pitch != lidar.VerticalScanMaxAngle().Radian())
    return document.note(
        element, fmt::format("{} sensor of {} rays: one ray is expected, with min_angle = "
                             "max_angle; list a `range` for each direction in a scene; left out",
                             in.TypeStr(), rays));
  const Vector3 ray(std::cos(pitch) * std::cos(yaw), std::cos(pitch) * std::sin(yaw),
                    std::sin(pitch));
  spec.sensor.kinds = {SensorKind::kRange};
  spec.sensor.X_FS.rotation = rotation_z_to(spec.sensor.X_FS.rotation * ray);
  spec.sensor.limit = lidar.RangeMax();
  if (lidar.RangeMin() > 0.0)
    document.note(element,
                  fmt::format("distances below min = {} m are read like others", lidar.RangeMin()));
  read_noise(document, element, {&lidar.LidarNoise()}, spec.sensor.errors);
  out.push_back(std::move(spec));
}

/// Reads a contact sensor; of several collisions each has a sensor of its own.
void read_contact(const sdf::Sensor& in, const SensorSpec& spec, std::vector<SensorSpec>& out) {
  std::vector<std::string> collisions;
  const sdf::ElementPtr contact = Document::child(in.Element(), "contact");
  for (sdf::ElementPtr e = Document::child(contact, "collision"); e;
       e = e->GetNextElement("collision")) {
    const auto path = e->Get<std::string>();
    collisions.push_back(path.substr(path.rfind(':') + 1));
  }
  if (collisions.empty()) collisions.emplace_back("__default__");
  for (const std::string& collision : collisions) {
    SensorSpec& one = out.emplace_back(spec);
    one.sensor.kinds = {SensorKind::kContactForce};
    if (collisions.size() > 1) one.sensor.name += "/" + collision;
    one.sensor.X_FS = Pose();
    if (collision != "__default__") one.link += "/" + collision;
  }
}

/// Returns the link M = JOINT.meter, with the frame of the inner link, between that and the joint.
std::string meter(const TreeJoint& at, RobotSpec& robot) {
  const std::string name = at.name + ".meter";
  for (const LinkSpec& link : robot.links)
    if (link.name == name) return name;
  const auto moved = std::find_if(robot.joints.begin(), robot.joints.end(), [&](const auto& joint) {
    return joint.name == at.motions.front();
  });
  LinkSpec link;
  link.name = name;
  link.where = moved->where;
  JointSpec weld;
  weld.name = name;
  weld.fixed = true;
  weld.parent = at.inner;
  weld.child = name;
  weld.where = moved->where;
  moved->parent = name;
  robot.links.push_back(link);
  robot.joints.push_back(weld);
  return name;
}

}  // namespace

void read_link_sensor(Document& document, const sdf::Sensor& in, const std::string& link,
                      const std::string& name, std::vector<SensorSpec>& out) {
  using Type = sdf::SensorType;
  SensorSpec spec = named(document, in, name, {});
  spec.link = name;
  spec.sensor.X_FS = document.resolve(in.SemanticPose(), link, in.Element());
  if (in.Type() == Type::IMU && in.ImuSensor() != nullptr)
    return read_imu(document, in, std::move(spec), out);
  if ((in.Type() == Type::LIDAR || in.Type() == Type::GPU_LIDAR) && in.LidarSensor() != nullptr)
    return read_lidar(document, in, std::move(spec), out);
  if (in.Type() == Type::CONTACT) return read_contact(in, spec, out);
  const char* remedy = in.Type() == Type::FORCE_TORQUE ? "belongs in the joint that it measures"
                       : in.Type() == Type::ALTIMETER
                           ? "has no counterpart; `position` and `linear_velocity` of a scene have "
                             "height and rate"
                           : "has no counterpart";
  document.note(in.Element(), fmt::format("{} sensor: {}; left out",
                                          in.Element()->Get<std::string>("type"), remedy));
}

std::optional<WrenchSensor> read_joint_sensor(Document& document, const sdf::Sensor& in,
                                              const std::string& joint, const std::string& name) {
  const sdf::ForceTorque* meter = in.ForceTorqueSensor();
  if (in.Type() != sdf::SensorType::FORCE_TORQUE || meter == nullptr) {
    document.note(in.Element(), in.TypeStr() + " sensor of a joint: has no counterpart; left out");
    return std::nullopt;
  }
  const sdf::ElementPtr element = meter->Element();
  if (meter->Frame() == sdf::ForceTorqueFrame::INVALID)
    document.fail(element, "<frame>: parent, child or sensor is expected");
  if (meter->MeasureDirection() == sdf::ForceTorqueMeasureDirection::INVALID)
    document.fail(element, "<measure_direction>: child_to_parent or parent_to_child is expected");
  WrenchSensor out;
  out.spec = named(document, in, name, {SensorKind::kForce, SensorKind::kTorque});
  out.axes = meter->Frame();
  out.on_parent = meter->MeasureDirection() == sdf::ForceTorqueMeasureDirection::CHILD_TO_PARENT;
  // libsdformat 12 resolves no pose of a joint's sensor.
  if (!in.PoseRelativeTo().empty() && in.PoseRelativeTo() != joint)
    document.fail(in.Element(), "<pose relative_to>: the joint itself is expected");
  const Pose X_JS = to_pose(in.RawPose());
  if (!X_JS.translation.isZero(0.0))
    document.note(in.Element(), "its torque is about the joint's origin, as the format says");
  out.R_JS = X_JS.rotation;
  read_noise(document, in.Element(),
             {&meter->ForceXNoise(), &meter->ForceYNoise(), &meter->ForceZNoise(),
              &meter->TorqueXNoise(), &meter->TorqueYNoise(), &meter->TorqueZNoise()},
             out.spec.sensor.errors);
  return out;
}

void place_wrench(const WrenchSensor& in, const TreeJoint& at, RobotSpec& robot,
                  std::vector<SensorSpec>& out) {
  const bool parents_axes = in.axes == sdf::ForceTorqueFrame::PARENT;
  // The orientation of the parent is fixed in the child too, unless the joint turns.
  const bool with_child = !parents_axes || !at.turns;
  Pose X_JS;
  X_JS.rotation = in.axes == sdf::ForceTorqueFrame::SENSOR
                      ? in.R_JS
                      : (parents_axes == at.reversed ? at.X_OJ : at.X_IJ).rotation.transpose();
  SensorSpec& spec = out.emplace_back(in.spec);
  std::string above = at.inner;  // the link that the one with the sensor hangs on
  if (at.motions.empty()) {
    spec.link = at.outer;
    spec.sensor.X_FS = at.X_OJ * X_JS;
  } else if (with_child == at.reversed) {
    spec.link = meter(at, robot);
    spec.sensor.X_FS = at.X_IJ * X_JS;
  } else {
    spec.joint = at.motions.back();
    spec.sensor.X_FS = X_JS;
    for (const JointSpec& joint : robot.joints)
      if (joint.name == spec.joint) above = joint.parent;
  }
  if (in.on_parent != at.reversed) spec.relative_to = above;
}

}  // namespace counterpoint::sdf_file
