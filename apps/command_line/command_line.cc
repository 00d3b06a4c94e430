#include "command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <optional>

#include "counterpoint/model/text_files.h"

namespace counterpoint::apps {
namespace {

constexpr int kSuccess = 0, kBadInput = 2;

/// Placeholder in the help for the value of an option that names none.
std::string usual_type(const CLI::Option& parser) {
  const std::string type = parser.get_type_name();
  return type == "FLOAT" ? "X" : type == "INT" || type == "UINT" ? "N" : "TEXT";
}

/// Splits "one|two" into the words allowed; a placeholder has capital letters and allows any word.
std::vector<std::string> allowed_words(const std::string& type) {
  const auto is_capital = [](unsigned char c) { return std::isupper(c) != 0; };
  if (type.empty() || std::any_of(type.begin(), type.end(), is_capital)) return {};
  return CLI::detail::split(type, '|');
}

int bad(const std::string& message, const std::string& advice) {
  fmt::print(stderr, "error: {}\n{}\n", message, advice);
  return kBadInput;
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

void required(Option& option) {
  option.required = true;
  option.parser->required();
}

void positive(Option& option) { option.parser->check(CLI::PositiveNumber); }
void not_negative(Option& option) { option.parser->check(CLI::NonNegativeNumber); }
void one_value_each(Option& option) { option.parser->allow_extra_args(false); }
void comma_separated(Option& option) { option.parser->delimiter(','); }
void seldom(Option& option) { option.seldom = true; }

Property range(double low, double high) {
  return [low, high](Option& option) {
    option.parser->check([low, high](const std::string& text) {
      double value = 0.0;
      if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high)
        return std::string();
      return fmt::format("{} is not between {} and {}", text, low, high);
    });
  };
}

Property needs(const Option& other) {
  return [parser = other.parser](Option& option) { option.parser->needs(parser); };
}

Property becomes(std::string (*resolve)(const std::string&)) {
  return [resolve](Option& option) { option.parser->transform(resolve); };
}

void show_default(Option& option) {
  option.parser->capture_default_str();
  option.description += fmt::format("; default {}", option.parser->get_default_str());
}

Command::Command(CLI::App& app, std::string name, std::string description, std::string footer,
                 std::function<int()> action)
    : app_(app),
      name_(std::move(name)),
      description_(std::move(description)),
      footer_(std::move(footer)),
      action_(std::move(action)) {}

template <typename T>
Option& Command::add(const std::string& usage, T& value, const std::string& description,
                     const std::vector<Property>& properties) {
  const size_t space = usage.find(' ');
  Option& option = *options_.emplace_back(std::make_unique<Option>());
  option.name = usage.substr(0, space);
  option.description = description;
  if (space != std::string::npos) option.type = usage.substr(space + 1);
  option.words = allowed_words(option.type);
  if constexpr (std::is_same_v<T, bool>) {
    option.parser = app_.add_flag(option.name, value);
  } else {
    option.parser = app_.add_option(option.name, value);
    if (option.type.empty()) option.type = usual_type(*option.parser);
  }
  if (option.is_argument()) option.type.clear();
  if (!option.words.empty())
    option.parser->check([words = option.words](const std::string& word) {
      if (std::find(words.begin(), words.end(), word) != words.end()) return std::string();
      return fmt::format("'{}' is none of {}{}", word, fmt::join(words, ", "),
                         did_you_mean(word, words));
    });
  for (const Property& property : properties) property(option);
  return option;
}

#define COUNTERPOINT_OPTION(...)                                                      \
  template Option& Command::add(const std::string&, __VA_ARGS__&, const std::string&, \
                                const std::vector<Property>&)
COUNTERPOINT_OPTION(bool);
COUNTERPOINT_OPTION(int);
COUNTERPOINT_OPTION(long);
COUNTERPOINT_OPTION(std::uint64_t);
COUNTERPOINT_OPTION(double);
COUNTERPOINT_OPTION(std::string);
COUNTERPOINT_OPTION(std::optional<int>);
COUNTERPOINT_OPTION(std::optional<double>);
COUNTERPOINT_OPTION(std::vector<double>);
COUNTERPOINT_OPTION(std::vector<std::string>);
#undef COUNTERPOINT_OPTION

std::vector<std::string> Command::option_names() const {
  std::vector<std::string> names = {"--help", "--help-all"};
  for (const auto& option : options_)
    if (!option->is_argument()) names.push_back(option->name);
  return names;
}

CommandLine::CommandLine(std::string description, std::string footer, std::vector<Topic> topics)
    : app_(std::make_unique<CLI::App>(description, "counterpoint")),
      description_(std::move(description)),
      footer_(std::move(footer)),
      topics_(std::move(topics)) {}

CommandLine::~CommandLine() = default;

Command& CommandLine::add(const std::string& name, const std::string& description,
                          const std::string& footer, std::function<int()> action) {
  CLI::App& app = *app_->add_subcommand(name, description);
  app.set_help_flag();
  return *commands_.emplace_back(
      std::make_unique<Command>(app, name, description, footer, std::move(action)));
}

Command* CommandLine::find(const std::string& name) const {
  for (const auto& command : commands_)
    if (command->name() == name) return command.get();
  return nullptr;
}

std::vector<std::string> CommandLine::command_names() const {
  std::vector<std::string> names;
  for (const auto& command : commands_) names.push_back(command->name());
  return names;
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
  std::vector<std::string> names = command_names();
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
  const std::string& first = words[0];
  if (first == "--help" || first == "-h" || first == "help" || first == "--help-all")
    return show_help({words.begin() + 1, words.end()});
  std::string version = "version";  // the command that is also an option
  if (first == "--version") {
    argv[1] = version.data();
    return parse(*find(version), argc, argv);
  }
  if (Command* command = find(first)) return parse(*command, argc, argv);
  std::vector<std::string> names = command_names();
  names.insert(names.begin(), {"help", "--version", "--help"});
  return bad(fmt::format("there is no subcommand '{}'{}", first, did_you_mean(first, names)),
             "'counterpoint --help' lists them.");
}

int CommandLine::parse(Command& command, int argc, char** argv) {
  const std::string advice =
      fmt::format("'counterpoint {} --help' lists what it takes.", command.name());
  const std::vector<std::string> names = command.option_names();
  for (int i = 2; i < argc; ++i) {
    const std::string word(argv[i]);
    if (word == "--") break;
    if (word == "--help" || word == "-h" || word == "--help-all") {
      fmt::print("{}", command.help(word == "--help-all"));
      return kSuccess;
    }
    const std::string name = word.substr(0, word.find('='));
    if (word.rfind("--", 0) == 0 && std::find(names.begin(), names.end(), name) == names.end())
      return bad(fmt::format("{}: there is no option '{}'{}", command.name(), name,
                             did_you_mean(name, names)),
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
