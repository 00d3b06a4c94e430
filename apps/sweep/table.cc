#include "table.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/engine/io/csv.h"
#include "variation.h"

namespace counterpoint::apps::sweep {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostReasons = 20;

std::vector<std::string> columns_of(const Study& study) {
  std::vector<std::string> columns{"task", "status", "reason"};
  for (const Axis& axis : study.axes) columns.push_back(axis.name);
  if (study.draws > 1) columns.emplace_back("draw");
  for (const char* name : {"steps", "end_time_s", kStateHashColumn}) columns.emplace_back(name);
  const std::vector<std::string> recorded = recorded_names(study);
  // What is varied may be recorded too: its end then says so.
  for (const std::string& name : recorded) {
    const bool twice = std::find(columns.begin(), columns.end(), name) != columns.end();
    columns.push_back(twice ? "end(" + name + ")" : name);
  }
  return columns;
}

void write_row(CsvWriter& csv, const Study& study, std::int64_t task, const Row& row) {
  const auto number = [&](double x) { std::isfinite(x) ? csv.number(x) : csv.empty(); };
  csv.text(std::to_string(task));
  csv.text(row.failed() ? "failed" : "ok");
  csv.text(row.reason);
  const std::vector<AxisValue> values = values_of(study, task);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (study.axes[i].has_words())
      csv.text(values[i].word);
    else
      number(values[i].number);
  }
  if (study.draws > 1) csv.text(std::to_string(draw_of(study, task)));
  number(row.steps);
  number(row.end_time);
  csv.text(std::to_string(row.state_hash));
  for (const double x : recorded_values(row)) number(x);
  csv.end_row();
}

}  // namespace

std::vector<std::string> recorded_names(const Study& study) {
  std::vector<std::string> names;
  if (study.record.final_state) {
    const CoordinateNames all = coordinate_names(study.scene.model);
    names = all.q;
    names.insert(names.end(), all.v.begin(), all.v.end());
  }
  for (const RecordedColumn& column : study.record.columns) names.push_back(column.name);
  names.insert(names.end(), study.record.figures.begin(), study.record.figures.end());
  return names;
}

std::vector<double> recorded_values(const Row& row) {
  std::vector<double> values = row.state;
  values.insert(values.end(), row.columns.begin(), row.columns.end());
  values.insert(values.end(), row.figures.begin(), row.figures.end());
  return values;
}

Summary write_table(const fs::path& file, const Study& study, const tasks::Results& results,
                    const std::function<void(std::int64_t, const Row&)>& take) {
  fs::path partial = file;
  partial.replace_filename("partial." + file.filename().string());
  Summary summary;
  try {
    CsvWriter csv(partial, columns_of(study));
    results.for_each([&](std::int64_t task, std::string&& bytes) {
      const Row row = Row::of(bytes);
      ++summary.rows;
      if (row.failed()) {
        ++summary.failed;
        if (summary.reasons.size() < kMostReasons) summary.reasons.emplace_back(task, row.reason);
      }
      write_row(csv, study, task, row);
      take(task, row);
    });
    csv.flush();
  } catch (...) {
    std::error_code error;
    fs::remove(partial, error);
    throw;
  }
  fs::rename(partial, file);
  return summary;
}

}  // namespace counterpoint::apps::sweep
