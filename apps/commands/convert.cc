// counterpoint convert: converts a motion, or any other table, to another format.
#include <fmt/format.h>

#include <filesystem>

#include "command.h"
#include "counterpoint/engine/tables.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

struct ConvertArguments {
  std::string input, output;
  Report report;
};

int convert(ConvertArguments& arguments) {
  const long rows = copy_table(arguments.input, arguments.output);
  const auto bytes = std::filesystem::file_size(arguments.output);
  Report& report = arguments.report;
  report.begin("convert", arguments.input);
  report["output"] = arguments.output;
  report["rows"] = rows;
  report["bytes"] = bytes;
  report.print("{}: {} rows, {} bytes\n", arguments.output, rows, bytes);
  report.write();
  return kSuccess;
}

}  // namespace

void add_convert(CommandLine& line) {
  auto [command, arguments] = line.add<ConvertArguments>(
      "convert", "Write a motion or another table in another format: CSV, HDF5, NumPy, MCAP",
      "Nothing is rounded. A file of a run that died is read as far as it goes.\n\n"
      "Example:\n  counterpoint convert fall.csv fall.h5",
      convert);
  command.add("INPUT", arguments.input, "Table to read: .csv, .h5, .npz, .mcap, .trc or .c3d",
              required);
  command.add("OUTPUT", arguments.output, "Table to write; its ending says the format", required);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
