// Columns of a table as a column map reads them.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"
#include "counterpoint/engine/motion_files.h"

namespace counterpoint::estimation {

/// A value that was not recorded.
inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// Is the cell of this source empty?
bool is_missing(const ColumnSource& source, const Table& table, int row);

/// scale * cell + offset. @throws InputError naming file, row and column where that is no finite
/// number.
double evaluate(const ColumnSource& source, const Table& table, int row);

/// Times that rise [s]: rows at a rate (0: none), or the sum of some columns.
std::vector<double> recorded_times(const Table& table, double rate,
                                   const std::vector<ColumnSource>& columns);

/// Programs count time since 1970 in whole nano-, micro- or milliseconds as often as in seconds; a
/// recording of motions has rows less than a second apart. Such a column is read in its unit, which
/// the note that is returned says; any other that cannot be seconds is refused. The columns are as
/// the map scales them.
std::string settle_time_unit(const Table& table, const std::string& column, bool unit_given,
                             std::vector<double>& time);

}  // namespace counterpoint::estimation
