// Results of a command in a machine-readable file: --json FILE (docs/reference/json-reports.md).
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace counterpoint::apps {

class Command;

using Json = nlohmann::ordered_json;

/// Writes a file, replacing an older one. @throws InputError if it cannot be written.
void write_file(const std::filesystem::path& file, const std::string& text);
/// Creates the folder of --report if it does not exist. @throws InputError if that fails.
void make_report_folder(const std::filesystem::path& folder);

/// Fills a format string with the entries of a JSON object: "{steps} steps, cost {cost:.3g}".
std::string format_entries(const std::string& format, const Json& entries);

class Report {
 public:
  /// Adds --json to the command.
  void add_to(Command& command);
  /// Starts the report with the entries common to all commands: command, version, scene.
  void begin(const std::string& command, const std::string& scene);
  Json& operator[](const char* key) { return json_[key]; }
  Json& json() { return json_; }
  bool has(const char* key) const { return json_.contains(key); }
  bool wanted() const { return !file_.empty(); }  ///< true if --json was given
  /// Stream for the command's text output: standard output, or standard error if the report goes to
  /// standard output.
  std::FILE* text() const { return file_ == "-" ? stderr : stdout; }
  /// Prints entries of this report, which the format names: "{steps} steps\n".
  void print_entries(const std::string& format) const {
    print("{}", format_entries(format, json_));
  }
  /// Prints to text().
  template <typename... Values>
  void print(fmt::format_string<const Values&...> format, const Values&... values) const {
    fmt::print(text(), format, values...);
  }
  /// Writes the file if --json was given ("-": standard output). @throws InputError if it cannot be
  /// created.
  void write() const;

 private:
  std::string file_;
  Json json_;
};

}  // namespace counterpoint::apps
