// Runs the built command as a user would, and reads the files that it writes.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "support/paths.h"

namespace counterpoint::test {

/// Name of the running test, usable as part of a file name.
inline std::string test_name() {
  std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

/// Column map whose first lines are `head`, of the free body `link`. Its columns have the names of
/// its coordinates, without the link's name if `bare`.
inline std::string free_body_map(const std::string& head, const std::string& link,
                                 bool bare = false) {
  std::string map = head + "free: " + link + "\ncolumns:\n";
  for (const std::string name :
       {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"})
    map += "  " + link + "." + name + ": " + (bare ? "" : link + ".") + name + "\n";
  return map;
}

struct CommandResult {
  int exit_code = -1;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};

/// Shell text that waits until the command with process number $run has installed its handler of
/// Ctrl-C (bit 2 of SigCgt in /proc/<pid>/status), or has ended.
inline const std::string kUntilInterruptible =
    "until grep -qs 'SigCgt:.*[2367abef]$' /proc/$run/status || ! kill -0 $run; "
    "do sleep 0.02; done; ";

/// A temporary folder for one test, removed by the destructor. Commands run in the root of the
/// sources.
class CommandFolder {
 public:
  explicit CommandFolder(const std::string& name);
  ~CommandFolder();
  CommandFolder(const CommandFolder&) = delete;
  CommandFolder& operator=(const CommandFolder&) = delete;

  /// Runs the command; `arguments` as on a command line, with "{}" replaced by the folder.
  CommandResult run(const std::string& arguments) const;
  /// Runs the command, expects success, and returns its standard output.
  std::string succeed(const std::string& arguments) const;
  /// Runs the command with --json {}/r.json, expects success, and returns the report.
  nlohmann::json report(const std::string& arguments) const;
  /// Runs the command; expects exit code 2 and `message` on standard error.
  void refuse(const std::string& arguments, const std::string& message) const;
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string read(const std::string& name) const;
  void write(const std::string& name, const std::string& content) const;
  /// Number of lines of a file.
  long lines(const std::string& name) const {
    const std::string text = read(name);
    return std::count(text.begin(), text.end(), '\n');
  }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(read(name)); }

 private:
  std::filesystem::path folder_;
};

inline CommandFolder::CommandFolder(const std::string& name)
    : folder_(std::filesystem::temp_directory_path() /
              ("counterpoint_" + name + "_" + std::to_string(getpid()))) {
  std::filesystem::create_directories(folder_);
}

inline CommandFolder::~CommandFolder() { std::filesystem::remove_all(folder_); }

inline CommandResult CommandFolder::run(const std::string& arguments) const {
  std::string line = arguments;
  for (size_t at = 0; (at = line.find("{}", at)) != std::string::npos;) {
    line.replace(at, 2, folder_.string());
  }
  const std::string command = "cd '" + source_dir() + "' && '" + command_file() + "' " + line +
                              " >'" + path("stdout") + "' 2>'" + path("stderr") + "'";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read("stdout"), read("stderr")};
}

inline std::string CommandFolder::succeed(const std::string& arguments) const {
  const CommandResult result = run(arguments);
  EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.errors;
  return result.output;
}

inline nlohmann::json CommandFolder::report(const std::string& arguments) const {
  succeed(arguments + " --json {}/r.json");
  return json("r.json");
}

inline void CommandFolder::refuse(const std::string& arguments, const std::string& message) const {
  const CommandResult result = run(arguments);
  EXPECT_EQ(result.exit_code, 2) << arguments;
  EXPECT_NE(result.errors.find(message), std::string::npos)
      << arguments << "\nexpected: " << message << "\ngot: " << result.errors;
}

inline std::string CommandFolder::read(const std::string& name) const {
  std::ifstream stream(folder_ / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void CommandFolder::write(const std::string& name, const std::string& content) const {
  std::ofstream(folder_ / name, std::ios::binary) << content;
}

/// Tests of `counterpoint simulate`, each in a folder of its own.
class SimulateTest : public testing::Test {
 protected:
  /// Runs `simulate`, expects success, and returns the report.
  nlohmann::json simulate(const std::string& arguments) const {
    return folder_.report("simulate " + arguments);
  }

  CommandFolder folder_{"simulate_" + test_name()};
};

}  // namespace counterpoint::test
