#include "counterpoint/engine/estimate/sensors/sensor_terms.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::estimation {
namespace {

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

}  // namespace

SensorTerms sensor_terms(const Model& model, const ColumnMap& map, const Recording& recording,
                         double h) {
  SensorTerms out;
  std::vector<int> delays(map.sources.size(), -1);
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
    if (sensor.has_offset) {
      term.offset_constant = static_cast<int>(out.constants.size());
      const int size = error_size(sensor.kind);
      for (int k = 0; k < size; ++k)
        out.constants.push_back({fmt::format("offset:{}{}{}", sensor.name, short_name(sensor.kind),
                                             size > 1 ? std::string(".") + "xyz"[k] : ""),
                                 sensor_unit(sensor.kind), offset_deviation(sensor.kind, model)});
    }
    for (std::size_t s = 0; s < map.sources.size(); ++s) {
      const SensorSource& source = map.sources[s];
      if (source.name != sensor.source) continue;
      term.delay = source.delay;
      if (!(source.delay_deviation > 0.0)) continue;
      if (delays[s] < 0) {
        delays[s] = static_cast<int>(out.constants.size());
        out.constants.push_back({"delay:" + source.name, "s", source.delay_deviation});
      }
      term.delay_constant = delays[s];
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
