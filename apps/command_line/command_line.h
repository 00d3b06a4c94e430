// Subcommands and their options. Only command_line.cc includes CLI11, which parses them: its header
// adds about ten seconds of compile time to every file that includes it.
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
  /// Sets the placeholder of the value in the help, such as "FILE".
  Option& type_name(const std::string& name);
  Option& one_of(const std::vector<std::string>& words);
  Option& range(double low, double high);
  Option& positive();
  Option& not_negative();
  Option& one_value_each();   ///< the option may be repeated, with one value each time
  Option& comma_separated();  ///< the value is a list: 1,2,3
  Option& needs(const Option& other);
  /// Replaces the given word by resolve(word) before it is stored; `resolve` may throw InputError.
  Option& becomes(std::string (*resolve)(const std::string&));
  Option& show_default();  ///< adds the variable's present value to the help text
  /// Hides the option from `--help`, so that this fits on one screen; `--help-all` lists it.
  Option& seldom();

 private:
  friend class Command;
  friend class CommandLine;
  CLI::Option* cli_ = nullptr;
  std::string name_, type_, description_;
  std::vector<std::string> words_;
  bool flag_ = false, required_ = false, seldom_ = false;
};

/// A subcommand. Variables bound to its options must outlive the parsing.
class Command {
 public:
  Command(CLI::App& app, std::string name, std::string description);
  /// `name`: "--name", or "NAME" for a positional argument. T: bool, int, long, double, string,
  /// path, their optionals and vectors (instantiated in command_line.cc).
  template <typename T>
  Option& add_option(const std::string& name, T& value, const std::string& description);
  Option& add_flag(const std::string& name, bool& value, const std::string& description);
  void footer(const std::string& text) { footer_ = text; }
  /// Sets the function that runs the command; it returns the exit code.
  void action(std::function<int()> run) { action_ = std::move(run); }

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  /// Help text of at most 100 columns; `all` includes the options marked seldom().
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

/// The whole command line: `counterpoint COMMAND ...` and `counterpoint help TOPIC`.
class CommandLine {
 public:
  CommandLine(const std::string& description, const std::string& footer);
  ~CommandLine();
  Command& add(const std::string& name, const std::string& description);
  /// Adds a text that `help NAME` shows.
  void add_topic(const std::string& name, const std::string& description, const std::string& text);
  /// Sets the text that --version prints.
  void version(std::function<std::string()> text) { version_ = std::move(text); }

  /// Parses the arguments and runs the command; returns its exit code. Reports a parse error on
  /// standard error and returns 2.
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

/// Returns "; did you mean 'simulate'?" with the nearest name by edit distance, or an empty string
/// if no name is near `word`.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& names);

}  // namespace counterpoint::apps
