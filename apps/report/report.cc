#include "report.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include <fstream>

#include "command_line/command_line.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps {

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text << std::flush;
  if (!stream) {
    throw InputError(fmt::format(
        "{}: cannot be written; expected a path in an existing, writable folder", file.string()));
  }
}

void make_report_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(fmt::format("--report {}: the folder cannot be made", folder.string()));
}

std::string format_entries(const std::string& format, const Json& entries) {
  fmt::dynamic_format_arg_store<fmt::format_context> values;
  for (const auto& [key, value] : entries.items()) {
    const char* name = key.c_str();
    if (value.is_string()) values.push_back(fmt::arg(name, value.get<std::string>()));
    if (value.is_number_float()) values.push_back(fmt::arg(name, value.get<double>()));
    if (value.is_number_unsigned())
      values.push_back(fmt::arg(name, value.get<std::uint64_t>()));
    else if (value.is_number_integer())
      values.push_back(fmt::arg(name, value.get<std::int64_t>()));
  }
  return fmt::vformat(format, values);
}

void Report::add_to(Command& command) {
  command.add("--json FILE", file_, "Write the figures as JSON ('-': standard output)");
}

void Report::begin(const std::string& command, const std::string& scene) {
  json_["command"] = command;
  json_["version"] = COUNTERPOINT_VERSION;
  json_["scene"] = scene;
}

void Report::write() const {
  if (file_.empty()) return;
  const std::string text = json_.dump(2) + "\n";
  if (file_ == "-") {
    fmt::print("{}", text);
    return;
  }
  write_file(file_, text);
}

}  // namespace counterpoint::apps
