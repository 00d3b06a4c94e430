// Reads sensors from the recording itself and from other files.
#include "counterpoint/engine/estimate/sensors/read_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/engine/estimate/sensors/sensor_signal.h"
#include "counterpoint/engine/estimate/sensors/table_columns.h"

namespace counterpoint::estimation {
namespace {

/// Reads the contact forces of a source at the row times of the recording, by interpolation.
void read_contact_forces(const Table& table, const ColumnMap& map, const SensorSource& source,
                         const std::vector<double>& time, Recording& recording) {
  const int rows = recording.num_rows();
  const double h = (recording.time.back() - recording.time.front()) / std::max(1, rows - 1);
  for (std::size_t k = 0; k < map.contact_forces.size(); ++k) {
    const ColumnMap::ContactForce& force = map.contact_forces[k];
    for (std::size_t axis = 0; axis < 3 && force.source == source.name; ++axis) {
      const ColumnSource& column = force.components[axis];
      if (column.column.empty()) continue;
      SensorReadings readings{time, MatrixX::Constant(1, table.num_rows(), kMissing)};
      for (int row = 0; row < table.num_rows(); ++row)
        if (!is_missing(column, table, row)) readings.values(0, row) = evaluate(column, table, row);
      Sensor plain;
      plain.kind = SensorKind::kCoordinate;
      const SensorSignal signal(plain, readings, h);
      for (int row = 0; row < rows; ++row) {
        Reading value;
        const double at = recording.time[static_cast<std::size_t>(row)] + source.delay;
        recording.contact_force(static_cast<Eigen::Index>(3 * k + axis), row) =
            signal.read(at, value) ? value[0] : kMissing;
      }
    }
  }
}

}  // namespace

void read_readings(const Table& table, const ColumnMap& map, const std::string& source,
                   const std::vector<double>& time, std::vector<SensorReadings>& out) {
  out.resize(map.sensors.size());
  for (std::size_t i = 0; i < map.sensors.size(); ++i) {
    const Sensor& sensor = map.sensors[i];
    if (sensor.source != source) continue;
    out[i].time = time;
    out[i].values.setConstant(static_cast<Eigen::Index>(sensor.columns.size()), table.num_rows(),
                              kMissing);
    for (int row = 0; row < table.num_rows(); ++row) {
      for (std::size_t k = 0; k < sensor.columns.size(); ++k)
        if (!is_missing(sensor.columns[k], table, row))
          out[i].values(static_cast<Eigen::Index>(k), row) =
              evaluate(sensor.columns[k], table, row);
      if (sensor.kind == SensorKind::kPoint)
        out[i].values.col(row) -= time[static_cast<std::size_t>(row)] * map.treadmill;
    }
  }
}

void read_sources(const std::map<std::string, std::string>& files, const ColumnMap& map,
                  Recording& recording) {
  std::set<std::string> known;
  for (const SensorSource& source : map.sources) {
    known.insert(source.name);
    const auto reads = [&](const Sensor& sensor) { return sensor.source == source.name; };
    if (source.delay_deviation > 0.0 && std::none_of(map.sensors.begin(), map.sensors.end(), reads))
      throw InputError(
          fmt::format("sources: {}: the delay is unknown, but no sensor that could tell "
                      "it is read from there; give the delay [s]",
                      source.name));
    const auto file = files.find(source.name);
    if (file == files.end())
      throw InputError(
          fmt::format("the column map has a source '{}'; say which file it is: "
                      "--source {}=FILE",
                      source.name, source.name));
    TableOptions options;
    options.nan_is_empty = true;
    const Table table(file->second, {}, options);
    std::vector<double> time = recorded_times(table, source.rate, source.time);
    if (!source.time.empty())
      settle_time_unit(table, source.time[0].column, source.time_unit_given, time);
    read_readings(table, map, source.name, time, recording.sensors);
    read_contact_forces(table, map, source, time, recording);
  }
  for (const auto& [name, file] : files)
    if (known.count(name) == 0)
      throw InputError(
          fmt::format("--source {}={}: the column map has no source '{}' (key "
                      "'sources')",
                      name, file, name));
}

void refuse_sensors(const ColumnMap& map, const std::string& command, bool takes_scene_sensors) {
  // Impacts take no time: there is no step whose sensors could be read.
  takes_scene_sensors = takes_scene_sensors && map.after.empty();
  const auto taken = [&](const Sensor& s) { return takes_scene_sensors && s.scene_sensor >= 0; };
  if (std::all_of(map.sensors.begin(), map.sensors.end(), taken) && map.sources.empty() &&
      map.treadmill.isZero(0.0))
    return;
  throw InputError(fmt::format(
      "{}: the column map has 'sensors', 'markers', 'sources' or 'treadmill', which only `explain` "
      "of whole recordings reads{}",
      command, takes_scene_sensors ? "; sensors of the scene may be given, without a kind" : ""));
}

void refuse_inputs(const ColumnMap& map, const std::string& command) {
  if (map.inputs.empty()) return;
  throw InputError(
      fmt::format("{}: the column map has the input '{}', which only predictions and inverse "
                  "dynamics row by row "
                  "replay; expected applied forces (JOINT.u), or no such column",
                  command, map.inputs.front().name));
}

}  // namespace counterpoint::estimation
