#include "command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <type_traits>

#include "counterpoint/model/text_files.h"

namespace counterpoint::apps {
namespace {

constexpr int kSuccess = 0, kBadInput = 2;

template <typename T>
struct Inner {
  using Type = T;
};
template <typename T>
struct Inner<std::optional<T>> {
  using Type = T;
};
template <typename T>
struct Inner<std::vector<T>> {
  using Type = T;
};

/// Default placeholder in the help for a value of type T.
template <typename T>
std::string type_word() {
  using Value = typename Inner<T>::Type;
  if constexpr (std::is_floating_point_v<Value>) return "X";
  if constexpr (std::is_integral_v<Value>) return "N";
  if constexpr (std::is_same_v<Value, std::filesystem::path>) return "FILE";
  return "TEXT";
}

}  // namespace

std::string did_you_mean(const std::string& word, const std::vector<std::string>& names) {
  std::string best;
  size_t least = std::max<size_t>(2, word.size() / 3) + 1;
  for (const std::string& name : names) {
    const bool begins = word.size() > 2 && name.rfind(word, 0) == 0;
    const size_t distance = begins ? 1 : static_cast<size_t>(edit_distance(word, name));
    if (distance >= least || distance >= name.size()) continue;
    least = distance;
    best = name;
  }
  return best.empty() ? std::string() : fmt::format("; did you mean '{}'?", best);
}

Option& Option::required() {
  required_ = true;
  cli_->required();
  return *this;
}

Option& Option::type_name(const std::string& name) {
  type_ = name;
  return *this;
}

Option& Option::one_of(const std::vector<std::string>& words) {
  words_ = words;
  type_ = fmt::format("{}", fmt::join(words, "|"));
  cli_->check([words](const std::string& word) {
    if (std::find(words.begin(), words.end(), word) != words.end()) return std::string();
    return fmt::format("'{}' is none of {}{}", word, fmt::join(words, ", "),
                       did_you_mean(word, words));
  });
  return *this;
}

Option& Option::range(double low, double high) {
  cli_->check([low, high](const std::string& text) {
    double value = 0.0;
    if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high)
      return std::string();
    return fmt::format("{} is not between {} and {}", text, low, high);
  });
  return *this;
}

Option& Option::positive() {
  cli_->check(CLI::PositiveNumber);
  return *this;
}

Option& Option::not_negative() {
  cli_->check(CLI::NonNegativeNumber);
  return *this;
}

Option& Option::one_value_each() {
  cli_->allow_extra_args(false);
  return *this;
}

Option& Option::comma_separated() {
  cli_->delimiter(',');
  return *this;
}

Option& Option::needs(const Option& other) {
  cli_->needs(other.cli_);
  return *this;
}

Option& Option::becomes(std::string (*resolve)(const std::string&)) {
  cli_->transform([resolve](const std::string& word) { return resolve(word); });
  return *this;
}

Option& Option::show_default() {
  cli_->capture_default_str();
  description_ += fmt::format("; default {}", cli_->get_default_str());
  return *this;
}

Option& Option::seldom() {
  seldom_ = true;
  return *this;
}

Command::Command(CLI::App& app, std::string name, std::string description)
    : app_(app), name_(std::move(name)), description_(std::move(description)) {}

Option& Command::added(const std::string& name, CLI::Option& option, const std::string& type,
                       const std::string& description) {
  options_.push_back(std::make_unique<Option>());
  Option& made = *options_.back();
  made.cli_ = &option;
  made.name_ = name;
  made.type_ = type;
  made.description_ = description;
  return made;
}

template <typename T>
Option& Command::add_option(const std::string& name, T& value, const std::string& description) {
  return added(name, *app_.add_option(name, value), type_word<T>(), description);
}

#define COUNTERPOINT_OPTION(...) \
  template Option& Command::add_option(const std::string&, __VA_ARGS__&, const std::string&)
COUNTERPOINT_OPTION(int);
COUNTERPOINT_OPTION(long);
COUNTERPOINT_OPTION(std::uint64_t);
COUNTERPOINT_OPTION(double);
COUNTERPOINT_OPTION(std::string);
COUNTERPOINT_OPTION(std::filesystem::path);
COUNTERPOINT_OPTION(std::optional<int>);
COUNTERPOINT_OPTION(std::optional<double>);
COUNTERPOINT_OPTION(std::vector<double>);
COUNTERPOINT_OPTION(std::vector<std::string>);
#undef COUNTERPOINT_OPTION

Option& Command::add_flag(const std::string& name, bool& value, const std::string& description) {
  Option& made = added(name, *app_.add_flag(name, value), "", description);
  made.flag_ = true;
  return made;
}

std::vector<std::string> Command::option_names() const {
  std::vector<std::string> names = {"--help", "--help-all"};
  for (const auto& option : options_)
    if (option->name_[0] == '-') names.push_back(option->name_);
  return names;
}

bool Command::has(const std::string& option) const {
  const std::vector<std::string> names = option_names();
  return std::find(names.begin(), names.end(), option) != names.end();
}

CommandLine::CommandLine(const std::string& description, const std::string& footer)
    : app_(std::make_unique<CLI::App>(description, "counterpoint")),
      description_(description),
      footer_(footer) {}

CommandLine::~CommandLine() = default;

Command& CommandLine::add(const std::string& name, const std::string& description) {
  CLI::App& app = *app_->add_subcommand(name, description);
  app.set_help_flag();
  commands_.push_back(std::make_unique<Command>(app, name, description));
  return *commands_.back();
}

void CommandLine::add_topic(const std::string& name, const std::string& description,
                            const std::string& text) {
  topics_.push_back({name, description, text});
}

Command* CommandLine::find(const std::string& name) const {
  for (const auto& command : commands_)
    if (command->name() == name) return command.get();
  return nullptr;
}

int CommandLine::bad(const std::string& message, const std::string& advice) const {
  fmt::print(stderr, "error: {}\n{}\n", message, advice);
  return kBadInput;
}

int CommandLine::show_help(const std::vector<std::string>& words) const {
  if (words.empty()) {
    fmt::print("{}", help());
    return kSuccess;
  }
  if (const Command* command = find(words[0])) {
    fmt::print("{}", command->help(true));
    return kSuccess;
  }
  std::vector<std::string> names;
  for (const auto& command : commands_) names.push_back(command->name());
  for (const Topic& topic : topics_) {
    names.push_back(topic.name);
    if (topic.name != words[0]) continue;
    fmt::print("{}", topic.text);
    return kSuccess;
  }
  return bad(fmt::format("there is no help on '{}'{}", words[0], did_you_mean(words[0], names)),
             "'counterpoint help' lists commands and topics.");
}

int CommandLine::run(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) return bad("a subcommand is expected", "'counterpoint --help' lists them.");
  if (words[0] == "--help" || words[0] == "-h" || words[0] == "help" || words[0] == "--help-all")
    return show_help({words.begin() + 1, words.end()});
  if (words[0] == "--version" || words[0] == "version") {
    fmt::print("{}", version_());
    return kSuccess;
  }
  Command* command = find(words[0]);
  if (command == nullptr) {
    std::vector<std::string> names = {"help", "--version", "--help"};
    for (const auto& known : commands_) names.push_back(known->name());
    return bad(
        fmt::format("there is no subcommand '{}'{}", words[0], did_you_mean(words[0], names)),
        "'counterpoint --help' lists them.");
  }
  return parse(*command, argc, argv);
}

int CommandLine::parse(Command& command, int argc, char** argv) {
  const std::string advice =
      fmt::format("'counterpoint {} --help' lists what it takes.", command.name());
  for (int i = 2; i < argc; ++i) {
    const std::string word(argv[i]);
    if (word == "--") break;
    if (word == "--help" || word == "-h" || word == "--help-all") {
      fmt::print("{}", command.help(word == "--help-all"));
      return kSuccess;
    }
    const std::string name = word.substr(0, word.find('='));
    if (word.rfind("--", 0) == 0 && !command.has(name))
      return bad(fmt::format("{}: there is no option '{}'{}", command.name(), name,
                             did_you_mean(name, command.option_names())),
                 advice);
  }
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bad(fmt::format("{}: {}", command.name(), error.what()), advice);
  }
  return command.action_();
}

}  // namespace counterpoint::apps
