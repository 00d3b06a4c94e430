// The table of sensor readings that `simulate --sensors` and `inverse --sensors` write.
#pragma once

#include <string>

#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/tables.h"
#include "report/report.h"

namespace counterpoint::apps {

/// One row per step: the time [s] of its start, and all columns of the model's sensors with the
/// errors that they have. A reading that does not exist is an empty cell.
class SensorLog {
 public:
  /// The model must outlive the log. @throws InputError if the model has no sensors, as
  /// SensorTable, or if the file cannot be written.
  SensorLog(const std::string& file, const Model& model, const SimulationOptions& options,
            std::uint64_t seed);
  void add_step(double time, const SensorStep& step);
  void finish() { writer_.finish(); }

 private:
  SensorTable table_;
  SensorSampler readings_;
  TableWriter writer_;
  VectorX exact_, row_;
};

/// Adds the sensors of a model with their columns to a report, under `sensors`, and prints them.
void report_sensors(const Model& model, Report& report);

}  // namespace counterpoint::apps
