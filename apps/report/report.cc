#include "report.h"

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

void Report::add_to(Command& command) {
  command.add_option("--json", file_, "Write the figures as JSON ('-': standard output)")
      .type_name("FILE");
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
