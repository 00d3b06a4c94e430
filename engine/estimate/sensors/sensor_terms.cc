#include "counterpoint/engine/estimate/sensors/sensor_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::estimation {
namespace {

/// Prior standard deviations of an unknown factor of readings, displacement [m] and rotation [rad].
constexpr double kScale = 0.1, kPosition = 0.05, kRotation = 0.1;

/// Prior standard deviation of an unknown offset.
double offset_deviation(SensorKind kind, const Model& model) {
  switch (kind) {
    case SensorKind::kPoint:
      return 0.05;  // [m]
    case SensorKind::kAngularVelocity:
      return 0.1;  // [rad/s]
    case SensorKind::kSpecificForce:
      return 1.0;  // [m/s^2]
    case SensorKind::kJointForce:
    case SensorKind::kLinkTorque:
      return 10.0;  // [N, N m]
    case SensorKind::kLinkForce:
    case SensorKind::kContactForce:
      return 0.1 * optimization::scene_weight(model);  // [N]
    default:
      return 0.1;  // [m, rad]
  }
}

const char* short_name(SensorKind kind) {
  if (kind == SensorKind::kLinkTorque) return ".torque";
  return kind == SensorKind::kAngularVelocity ? ".angular" : "";
}

bool depends_on_position(SensorKind kind) {
  return kind == SensorKind::kPoint || kind == SensorKind::kSpecificForce ||
         kind == SensorKind::kLinkTorque;
}

/// The constants of all sensors as they are added.
class ConstantList {
 public:
  ConstantList(const Model& model, std::vector<SensorConstant>& out) : model_(model), out_(out) {}

  /// Adds the unknown constants of a sensor. The parts of a sensor share their placement.
  void add(SensorTerm& term) {
    const Sensor& sensor = term.sensor;
    const SensorKind kind = sensor.kind;
    const std::string name = sensor.name + short_name(kind);
    if (sensor.has_offset)
      term.offset_constant = add("offset:" + name, sensor_unit(kind), error_size(kind),
                                 offset_deviation(kind, model_));
    if (sensor.has_scale) term.scale_constant = add("scale:" + name, "1", 1, kScale);
    if (!sensor.has_placement) return;
    if (depends_on_position(kind))
      term.position_constant = add("position:" + sensor.name, "m", 3, kPosition);
    if (kind != SensorKind::kPoint)
      term.rotation_constant = add("rotation:" + sensor.name, "rad", 3, kRotation);
  }

  int add_delay(const SensorSource& source) {
    return add("delay:" + source.name, "s", 1, source.delay_deviation);
  }

 private:
  /// Returns the index of the first of `count` constants, which are new unless they have this name.
  int add(const std::string& name, const char* unit, int count, double deviation) {
    const auto [found, is_new] = first_.emplace(name, static_cast<int>(out_.size()));
    for (int k = 0; is_new && k < count; ++k)
      out_.push_back({count > 1 ? fmt::format("{}.{}", name, "xyz"[k]) : name, unit, deviation});
    return found->second;
  }

  const Model& model_;
  std::vector<SensorConstant>& out_;
  std::map<std::string, int> first_;
};

}  // namespace

SensorTerms sensor_terms(const Model& model, const ColumnMap& map, const Recording& recording,
                         double h) {
  SensorTerms out;
  ConstantList constants(model, out.constants);
  for (std::size_t i = 0; i < map.sensors.size(); ++i) {
    const Sensor& sensor = map.sensors[i];
    if (sensor.kind == SensorKind::kOther)
      throw InputError(fmt::format(
          "sensor '{}': estimates of motions take no such quantity (docs/reference/sensor-map.md "
          "lists those that they take); `compare` does",
          sensor.name));
    static const SensorReadings kNone;
    const SensorReadings& readings = i < recording.sensors.size() ? recording.sensors[i] : kNone;
    SensorTerm& term = out.terms.emplace_back(
        SensorTerm{.sensor = sensor, .signal = SensorSignal(sensor, readings, h)});
    if (!(term.signal.deviation() > 0.0))
      throw InputError(
          fmt::format("{}: sensor '{}' has fewer than two readings", recording.file, sensor.name));
    term.weight = 1.0 / term.signal.deviation();
    constants.add(term);
    for (const SensorSource& source : map.sources) {
      if (source.name != sensor.source) continue;
      term.delay = source.delay;
      if (source.delay_deviation > 0.0) term.delay_constant = constants.add_delay(source);
    }
  }
  return out;
}

SensorTerms without_positions(const SensorTerms& all) {
  SensorTerms out{{}, all.constants};
  for (const SensorTerm& term : all.terms)
    if (!is_position(term.sensor.kind) || term.delay_constant >= 0) out.terms.push_back(term);
  return out;
}

}  // namespace counterpoint::estimation
