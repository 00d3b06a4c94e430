#include "sensor_log.h"

#include <cmath>

namespace counterpoint::apps {
namespace {

std::vector<Column> log_columns(const Model& model) {
  if (model.sensors().empty())
    throw InputError(
        "--sensors: the scene has no sensors; list them under `sensors` in the scene file "
        "(docs/reference/sensors.md)");
  std::vector<Column> columns{"time"};
  for (const SensorColumn& column : sensor_columns(model)) columns.emplace_back(column.name);
  return columns;
}

}  // namespace

SensorLog::SensorLog(const std::string& file, const Model& model, const SimulationOptions& options,
                     std::uint64_t seed)
    : table_(model, options),
      readings_(model, seed),
      writer_(file, log_columns(model)),
      exact_(table_.size()),
      row_(table_.size()) {}

void SensorLog::add_step(double time, const SensorStep& step) {
  table_.evaluate(step, exact_);
  readings_.read(time, exact_, row_);
  writer_.number(time);
  for (const double x : row_) {
    if (std::isnan(x)) {
      writer_.empty();
    } else {
      writer_.number(x);
    }
  }
  writer_.end_row();
}

void report_sensors(const Model& model, Report& report) {
  const std::vector<SensorColumn> columns = sensor_columns(model);
  if (!columns.empty()) report.print("\nsensors (columns of --sensors):\n");
  Json list = Json::array();
  for (std::size_t i = 0; i < model.sensors().size(); ++i) {
    const counterpoint::Sensor& sensor = model.sensors()[i];
    Json kinds = Json::array(), own = Json::array();
    for (const counterpoint::SensorKind kind : sensor.kinds)
      kinds.push_back(sensor_kind_name(kind));
    report.print(" ");
    for (const SensorColumn& column : columns) {
      if (column.sensor != static_cast<int>(i)) continue;
      own.push_back({{"name", column.name}, {"unit", column.unit}, {"frame", column.frame}});
      report.print(" {} [{}]", column.name, column.unit);
    }
    report.print("\n");
    list.push_back({{"name", sensor.name}, {"kinds", kinds}, {"columns", own}});
  }
  report["sensors"] = list;
}

}  // namespace counterpoint::apps
