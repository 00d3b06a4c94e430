// The version that scenes, tables and other files may carry (docs/reference/versions.md).
#pragma once

#include <string>
#include <string_view>

namespace counterpoint {

/// Returns the format that this program writes, MAJOR.MINOR of its version: "0.1".
std::string file_format();

/// Checks the format that a file states. `where` is the place, for messages. @throws InputError if
/// it is no MAJOR.MINOR, or later than file_format().
void check_file_format(std::string_view stated, const std::string& where);

/// Returns the name of the empty column that states the format of a table: "format.0.1".
std::string format_column();

/// Returns the format that such a name states; "" for the name of any other column.
std::string_view format_of_column(std::string_view name);

}  // namespace counterpoint
