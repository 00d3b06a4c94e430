// Results of a command for programs: --json FILE (docs/reference/json-reports.md).
#pragma once

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace counterpoint::apps {

class Command;

using Json = nlohmann::ordered_json;

/// Writes a file anew. @throws InputError if it cannot be written.
void write_file(const std::filesystem::path& file, const std::string& text);
/// Makes the folder of --report, if it is not there. @throws InputError if it cannot be made.
void make_report_folder(const std::filesystem::path& folder);

class Report {
 public:
  /// Adds --json to the command.
  void add_to(Command& command);
  /// Starts the report with what every command says: command, version, scene.
  void begin(const std::string& command, const std::string& scene);
  Json& operator[](const char* key) { return json_[key]; }
  Json& json() { return json_; }
  bool wanted() const { return !file_.empty(); }  ///< was --json given?
  /// Where the command's text for people goes: standard output, unless the report goes there.
  std::FILE* text() const { return file_ == "-" ? stderr : stdout; }
  /// Writes the file if --json was given ("-": standard output). @throws InputError if it cannot be
  /// created.
  void write() const;

 private:
  std::string file_;
  Json json_;
};

}  // namespace counterpoint::apps
