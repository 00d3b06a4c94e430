// Columns of a table as defined by a column map.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"
#include "counterpoint/engine/tables.h"

namespace counterpoint::estimation {

/// A missing value.
inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// Returns whether the cell of this source is empty.
bool is_missing(const ColumnSource& source, const Table& table, int row);

/// Returns scale * cell + offset. @throws InputError naming file, row and column if it is not
/// finite.
double evaluate(const ColumnSource& source, const Table& table, int row);

/// Row times [s], from a rate (0: none) or the sum of some columns. @throws InputError if they do
/// not increase.
std::vector<double> recorded_times(const Table& table, double rate,
                                   const std::vector<ColumnSource>& columns);

/// Converts times in whole nano-, micro- or milliseconds since 1970 to seconds, in place, and
/// returns a note that says so; rows of motion recordings are less than a second apart. Times are
/// after the map's scaling. @throws InputError for other times that cannot be seconds.
std::string settle_time_unit(const Table& table, const std::string& column, bool unit_given,
                             std::vector<double>& time);

}  // namespace counterpoint::estimation
