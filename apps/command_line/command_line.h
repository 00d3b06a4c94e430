// Subcommands and their options. CLI11 parses them, in command_line.cc and nowhere else: its
// header adds about ten seconds of compile time to every file that includes it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace counterpoint::apps {

/// One option or positional argument of a command.
class Option {
 public:
  Option& required();
  /// What stands for the value in the help: "FILE".
  Option& type_name(const std::string& name);
  Option& one_of(const std::vector<std::string>& words);
  Option& range(double low, double high);
  Option& positive();
  Option& not_negative();
  Option& one_value_each();   ///< given several times, each time with one value
  Option& comma_separated();  ///< a list: 1,2,3
  Option& needs(const Option& other);
  /// The word given is replaced before it is kept; may throw InputError.
  Option& becomes(std::string (*resolve)(const std::string&));
  Option& show_default();  ///< the help names the variable's value
  /// Seldom wanted: `--help-all` lists it, `--help` does not, which then fits one screen.
  Option& seldom();

 private:
  friend class Command;
  friend class CommandLine;
  CLI::Option* cli_ = nullptr;
  std::string name_, type_, description_;
  std::vector<std::string> words_;
  bool flag_ = false, required_ = false, seldom_ = false;
};

/// A subcommand. Variables given to it must outlive the parsing.
class Command {
 public:
  Command(CLI::App& app, std::string name, std::string description);
  /// "--name" or, of a positional argument, "NAME". T: bool, int, long, double, string, path, their
  /// optionals and vectors (see command_line.cc).
  template <typename T>
  Option& add_option(const std::string& name, T& value, const std::string& description);
  Option& add_flag(const std::string& name, bool& value, const std::string& description);
  void footer(const std::string& text) { footer_ = text; }
  /// What the command does; returns the exit code.
  void action(std::function<int()> run) { action_ = std::move(run); }

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  /// Help of at most 100 columns; `all`: with what is seldom wanted.
  std::string help(bool all) const;

 private:
  friend class CommandLine;
  Option& added(const std::string& name, CLI::Option& option, const std::string& type,
                const std::string& description);
  bool has(const std::string& option) const;
  std::vector<std::string> option_names() const;
  std::string usage() const;

  CLI::App& app_;
  std::string name_, description_, footer_;
  std::vector<std::unique_ptr<Option>> options_;
  std::function<int()> action_;
};

/// The whole command line: `counterpoint COMMAND ...`, `counterpoint help TOPIC`.
class CommandLine {
 public:
  CommandLine(const std::string& description, const std::string& footer);
  ~CommandLine();
  Command& add(const std::string& name, const std::string& description);
  /// A text that `help NAME` shows.
  void add_topic(const std::string& name, const std::string& description, const std::string& text);
  /// What --version prints.
  void version(std::function<std::string()> text) { version_ = std::move(text); }

  /// Parses and runs. What cannot be parsed is said on standard error, exit code 2.
  int run(int argc, char** argv);

  std::string help() const;
  std::string bash_completion() const;  ///< a script for bash
  std::string man_page() const;         ///< troff
  std::string markdown() const;         ///< docs/reference/options.md

 private:
  struct Topic {
    std::string name, description, text;
  };
  Command* find(const std::string& name) const;
  int show_help(const std::vector<std::string>& words) const;
  int bad(const std::string& message, const std::string& advice) const;
  int parse(Command& command, int argc, char** argv);

  std::unique_ptr<CLI::App> app_;
  std::string description_, footer_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::vector<Topic> topics_;
  std::function<std::string()> version_;
};

/// ", did you mean 'simulate'?", or nothing where no name is near `word`.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& names);

}  // namespace counterpoint::apps
