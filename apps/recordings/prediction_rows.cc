#include "prediction_rows.h"

#include <vector>

namespace counterpoint::apps {

PredictionRows::PredictionRows(const std::string& file, const ColumnMap& map) : map_(map) {
  if (file.empty()) return;
  std::vector<Column> columns{{"recording", CellType::kText}, "time"};
  if (!map.after.empty()) {
    columns[1].name = "contacts";
    columns.insert(columns.end(), {"velocity_error_m_s", "energy_ratio", "recorded_energy_ratio"});
    for (const ColumnMap::Entry& entry : map.after) {
      columns.push_back(entry.name);
      columns.push_back(entry.name + ".recorded");
    }
    table_ = std::make_unique<TableWriter>(file, columns);
    return;
  }
  if (map.free_body >= 0) {
    columns.insert(columns.end(), {"position_error_m", "rotation_error_deg"});
  } else {
    columns.emplace_back("joint_error");
  }
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    columns.push_back(entry.name);
    columns.push_back(entry.name + ".recorded");
  }
  for (const auto& sensor : map.sensors) {
    for (const ColumnSource& column : sensor.columns) {
      columns.push_back(column.column);
      columns.push_back(column.column + ".recorded");
    }
  }
  table_ = std::make_unique<TableWriter>(file, columns);
}

void PredictionRows::write(const Recording& recording, const Prediction& prediction) {
  if (!table_) return;
  if (prediction.impact) return write_impact(recording, prediction);
  size_t predicted = 0;
  for (int row = 0; row < recording.num_rows(); ++row) {
    const bool start =
        predicted == prediction.time.size() || recording.time[row] != prediction.time[predicted];
    if (start && row > 0) break;  // a step failed
    write_row(recording, row, start ? Deviation() : prediction.deviations[predicted++], prediction);
  }
}

void PredictionRows::finish() {
  if (table_) table_->finish();
}

void PredictionRows::write_impact(const Recording& recording, const Prediction& prediction) {
  const ImpactDeviation& impact = *prediction.impact;
  table_->text(recording.file);
  table_->number(impact.contacts);
  for (const double x : {impact.speed, impact.energy_ratio, impact.recorded_energy_ratio})
    table_->number(x);
  for (const ColumnMap::Entry& entry : map_.after) {
    const double recorded = recording.v(entry.index, 1);
    table_->number(recorded + prediction.velocity_error(entry.index, 0));
    table_->number(recorded);
  }
  table_->end_row();
}

void PredictionRows::write_row(const Recording& recording, int row, const Deviation& deviation,
                               const Prediction& prediction) {
  table_->text(recording.file);
  table_->number(recording.time[row]);
  if (map_.free_body >= 0) {
    table_->number(deviation.position);
    table_->number(deviation.rotation);
  } else {
    table_->number(deviation.joints);
  }
  for (const ColumnMap::Entry& entry : map_.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    table_->number(prediction.q(entry.index, row));
    table_->number(recording.q(entry.index, row));
  }
  Eigen::Index sensed = 0;
  for (const SensorReadings& readings : recording.sensors) {
    for (Eigen::Index k = 0; k < readings.values.rows(); ++k) {
      table_->number(prediction.sensors(sensed++, row));
      table_->number(readings.values(k, row));
    }
  }
  table_->end_row();
}

}  // namespace counterpoint::apps
