#include "counterpoint/engine/estimate/sensors/table_columns.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {
namespace {

/// Returns whether this is a time since 1970, in this unit [s], between the years 2000 and 2100.
bool since_1970(double time, double unit) { return time * unit > 9.4e8 && time * unit < 4.1e9; }

}  // namespace

bool is_missing(const ColumnSource& source, const Table& table, int row) {
  return !source.column.empty() && std::isnan(table.cell(row, table.column(source.column)));
}

double evaluate(const ColumnSource& source, const Table& table, int row) {
  if (source.column.empty()) return source.offset;
  const double value = source.scale * table.value(row, table.column(source.column)) + source.offset;
  if (std::isfinite(value)) return value;
  throw InputError(
      fmt::format("{}: column '{}': scale and offset of the column map make {} of it; a "
                  "finite number is expected",
                  table.where(row), source.column, value));
}

std::vector<double> recorded_times(const Table& table, double rate,
                                   const std::vector<ColumnSource>& columns) {
  std::vector<double> out;
  for (int row = 0; row < table.num_rows(); ++row) {
    double time = rate > 0.0 ? row / rate : 0.0;
    for (const ColumnSource& source : columns) time += evaluate(source, table, row);
    if (row > 0 && !(time > out.back()))
      throw InputError(fmt::format("{}: time {} does not rise", table.where(row), time));
    out.push_back(time);
  }
  return out;
}

std::string settle_time_unit(const Table& table, const std::string& column, bool unit_given,
                             std::vector<double>& time) {
  constexpr double kLargest = 1e12,
                   kLongest = 1e5;  // [s]: no motion recording spans 30,000 years or pauses a day
  if (time.size() < 2) return {};
  std::vector<double> steps;
  for (std::size_t row = 1; row < time.size(); ++row) steps.push_back(time[row] - time[row - 1]);
  const double step = median(steps);
  if (std::abs(time[0]) <= kLargest && step <= kLongest) return {};
  for (const auto& [unit, name] :
       {std::pair{1e-9, "nanoseconds"}, {1e-6, "microseconds"}, {1e-3, "milliseconds"}}) {
    if (unit_given || !since_1970(time[0], unit) || step * unit >= 1.0) continue;
    for (double& t : time) t *= unit;
    return fmt::format(
        "{}: time '{}' is read as {} since 1970; the column map says so with time: {{column: {}, "
        "scale: {:g}}}",
        table.file(), column, name, column, unit);
  }
  throw InputError(
      fmt::format("{}: time '{}' starts at {:.9g} with steps of {:.6g}, which cannot be seconds; "
                  "say its unit in the column "
                  "map: time: {{column: {}, scale: 1e-9}} for nanoseconds, 1e-6 for microseconds",
                  table.where(0), column, time[0], step, column));
}

}  // namespace counterpoint::estimation
