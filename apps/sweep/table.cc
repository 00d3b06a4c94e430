#include "table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "counterpoint/engine/trajectory.h"
#include "tasks/archive.h"
#include "variation.h"

namespace counterpoint::apps::sweep {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostReasons = 20;

/// Index of each failure reason among the labels of a column, for formats that store no texts.
using Reasons = std::map<std::string, int>;

std::vector<std::string> words_of(const Reasons& reasons) {
  std::vector<std::string> words(reasons.size());
  for (const auto& [reason, index] : reasons) words[static_cast<std::size_t>(index)] = reason;
  return words;
}

/// All reasons in the rows, in the order of tasks; index 0 is "" (none).
Reasons reasons_of(const tasks::Results& results) {
  Reasons reasons{{"", 0}};
  results.for_each([&](std::int64_t, std::string&& bytes) {
    reasons.try_emplace(tasks::from_bytes<Row>(bytes).reason, static_cast<int>(reasons.size()));
  });
  return reasons;
}

std::vector<Column> columns_of(const Study& study, const std::optional<Reasons>& reasons) {
  std::vector<Column> columns{{"task", CellType::kInteger},
                              {"status", CellType::kLabel, {"ok", "failed"}}};
  if (reasons)
    columns.emplace_back("reason", CellType::kLabel, words_of(*reasons));
  else
    columns.emplace_back("reason", CellType::kText);
  for (const Axis& axis : study.axes) {
    if (axis.has_words())
      columns.emplace_back(axis.name, CellType::kLabel, axis.words);
    else
      columns.emplace_back(axis.name);
  }
  if (study.draws > 1) columns.emplace_back("draw", CellType::kInteger);
  columns.emplace_back("steps");
  columns.emplace_back("end_time_s");
  columns.emplace_back(kStateHashColumn, CellType::kInteger);
  // A varied quantity may be recorded too; then its recorded column is named end(NAME).
  for (const std::string& name : recorded_names(study)) {
    const bool twice = std::any_of(columns.begin(), columns.end(),
                                   [&](const Column& column) { return column.name == name; });
    columns.emplace_back(twice ? "end(" + name + ")" : name);
  }
  return columns;
}

void write_row(TableWriter& table, const Study& study, const std::optional<Reasons>& reasons,
               std::int64_t task, const Row& row) {
  const auto number = [&](double x) { std::isfinite(x) ? table.number(x) : table.empty(); };
  table.integer(static_cast<std::uint64_t>(task));
  table.label(row.failed() ? 1 : 0);
  if (reasons)
    table.label(reasons->at(row.reason));
  else
    table.text(row.reason);
  const std::vector<AxisValue> values = values_of(study, task);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (study.axes[i].has_words())
      table.label(static_cast<int>(study.axes[i].level_of(values[i])));
    else
      number(values[i].number);
  }
  if (study.draws > 1) table.integer(static_cast<std::uint64_t>(draw_of(study, task)));
  number(row.steps);
  number(row.end_time);
  table.integer(row.state_hash);
  for (const double x : recorded_values(row)) number(x);
  table.end_row();
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
  names.insert(names.end(), study.record.metrics.begin(), study.record.metrics.end());
  return names;
}

std::vector<double> recorded_values(const Row& row) {
  std::vector<double> values = row.state;
  values.insert(values.end(), row.columns.begin(), row.columns.end());
  values.insert(values.end(), row.metrics.begin(), row.metrics.end());
  return values;
}

Summary write_table(const fs::path& file, const Study& study, const tasks::Results& results,
                    const std::function<void(std::int64_t, const Row&)>& take) {
  fs::path partial = file;
  partial.replace_filename("partial." + file.filename().string());
  Summary summary;
  try {
    std::optional<Reasons> reasons;
    if (file.extension() != ".csv") reasons = reasons_of(results);
    TableWriter writer(partial, columns_of(study, reasons));
    results.for_each([&](std::int64_t task, std::string&& bytes) {
      const auto row = tasks::from_bytes<Row>(bytes);
      ++summary.rows;
      if (row.failed()) {
        ++summary.failed;
        if (summary.reasons.size() < kMostReasons) summary.reasons.emplace_back(task, row.reason);
      }
      write_row(writer, study, reasons, task, row);
      take(task, row);
    });
    writer.finish();
  } catch (...) {
    std::error_code error;
    fs::remove(partial, error);
    throw;
  }
  fs::rename(partial, file);
  return summary;
}

}  // namespace counterpoint::apps::sweep
