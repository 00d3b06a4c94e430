// Subcommands and their options. Only command_line.cc includes CLI11, which parses them: its header
// adds about ten seconds of compile time to every file that includes it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace counterpoint::apps {

/// One option or positional argument of a command.
struct Option {
  std::string name, description;
  std::string type;                ///< placeholder of the value; empty: a flag or an argument
  std::vector<std::string> words;  ///< the only values allowed; empty: any
  bool required = false, seldom = false;
  CLI::Option* parser = nullptr;

  bool is_argument() const { return name[0] != '-'; }
  /// Name and placeholder, as the help shows them: "--report DIR".
  std::string usage() const { return type.empty() ? name : name + " " + type; }
};

// Properties of an option, given after its description.
using Property = std::function<void(Option&)>;
void required(Option& option);
void positive(Option& option);
void not_negative(Option& option);
Property range(double low, double high);
void one_value_each(Option& option);   ///< the option may be repeated, with one value each time
void comma_separated(Option& option);  ///< the value is a list: 1,2,3
Property needs(const Option& other);
/// Replaces the given word by resolve(word) before it is stored; `resolve` may throw InputError.
Property becomes(std::string (*resolve)(const std::string&));
void show_default(Option& option);  ///< adds the variable's present value to the help text
/// Hides the option from `--help`, so that this fits on one screen; `--help-all` lists it.
void seldom(Option& option);

/// A subcommand. Variables bound to its options must outlive the parsing.
class Command {
 public:
  Command(CLI::App& app, std::string name, std::string description, std::string footer,
          std::function<int()> action);
  /// Adds an option or an argument. `usage`: "--name", "--name TYPE", "--name one|two" (in lower
  /// case, the only words allowed), or "NAME" for a positional argument. T: bool (a flag), int,
  /// long, double, string, their optionals and vectors (instantiated in command_line.cc).
  template <typename T>
  Option& add(const std::string& usage, T& value, const std::string& description,
              const std::vector<Property>& properties);
  template <typename T, typename... Properties>
  Option& add(const std::string& usage, T& value, const std::string& description,
              const Properties&... properties) {
    return add(usage, value, description, std::vector<Property>{properties...});
  }

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  /// Help text of at most 100 columns; `all` includes the options marked seldom.
  std::string help(bool all) const;

 private:
  friend class CommandLine;
  std::vector<std::string> option_names() const;
  std::string usage() const;

  CLI::App& app_;
  std::string name_, description_, footer_;
  std::vector<std::unique_ptr<Option>> options_;
  std::function<int()> action_;  ///< returns the exit code
};

/// A text that `counterpoint help NAME` shows.
struct Topic {
  std::string name, description, text;
};

/// The whole command line: `counterpoint COMMAND ...` and `counterpoint help TOPIC`.
class CommandLine {
 public:
  CommandLine(std::string description, std::string footer, std::vector<Topic> topics);
  ~CommandLine();
  /// Adds a command: the options added to it fill `Arguments`, which `run` turns into the exit
  /// code.
  template <typename Arguments>
  std::pair<Command&, Arguments&> add(const std::string& name, const std::string& description,
                                      const std::string& footer,
                                      std::function<int(Arguments&)> run) {
    auto arguments = std::make_shared<Arguments>();
    return {add(name, description, footer, [=] { return run(*arguments); }), *arguments};
  }

  /// Parses the arguments and runs the command; returns its exit code. Reports a parse error on
  /// standard error and returns 2. `--version` is the command of that name.
  int run(int argc, char** argv);

  std::string help() const;
  std::string bash_completion() const;  ///< a script for bash
  std::string man_page() const;         ///< troff
  std::string markdown() const;         ///< docs/reference/options.md

 private:
  Command& add(const std::string& name, const std::string& description, const std::string& footer,
               std::function<int()> action);
  Command* find(const std::string& name) const;
  std::vector<std::string> command_names() const;
  int show_help(const std::vector<std::string>& words) const;
  int parse(Command& command, int argc, char** argv);

  std::unique_ptr<CLI::App> app_;
  std::string description_, footer_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::vector<Topic> topics_;
};

/// Returns "; did you mean 'simulate'?" with the nearest name by edit distance, or an empty string
/// if no name is near `word`.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& names);

}  // namespace counterpoint::apps
