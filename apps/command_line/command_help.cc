// Texts generated from the options of the commands: help, man page, completion, reference.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "command_line.h"

namespace counterpoint::apps {
namespace {

constexpr size_t kWidth = 100, kNames = 32;  // columns

constexpr const char* kBashCompletion =
    R"bash(# Completion of counterpoint for bash; written by `counterpoint generate bash`.
_counterpoint() {
  local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD - 1]}" command="${COMP_WORDS[1]}"
  local options="" values=""
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    mapfile -t COMPREPLY < <(compgen -W "@NAMES@help --help --version" -- "$word")
    return
  fi
  case "$command" in
    help) options="@NAMES@@TOPICS@" ;;
@OPTIONS@  esac
  case "$command:$before" in
@VALUES@  esac
  if [ -n "$values" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$word")
  elif [ "$command" = help ] || [[ "$word" == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
    if [ "$COMP_CWORD" -eq 2 ]; then
      mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -W "$(counterpoint list scenes 2>/dev/null)" -- "$word")
    fi
  fi
}
complete -F _counterpoint counterpoint
)bash";

/// Breaks text into lines of at most kWidth columns. The first line continues at column `at`; the
/// others begin after `indent` spaces.
std::string wrapped(const std::string& text, size_t indent, size_t at) {
  std::string out;
  std::istringstream words(text);
  bool first = true;
  for (std::string word; words >> word;) {
    if (!first && at + 1 + word.size() > kWidth) {
      out += '\n';
      out.append(indent, ' ');
      at = indent;
    } else if (!first) {
      out += ' ';
      ++at;
    }
    out += word;
    at += word.size();
    first = false;
  }
  return out;
}

std::string entry(const std::string& name, const std::string& description) {
  std::string line = "  " + name;
  line += line.size() + 2 > kNames ? "  " : std::string(kNames - line.size(), ' ');
  return line + wrapped(description, kNames, line.size()) + "\n";
}

/// Escapes the characters that have a meaning in troff.
std::string troff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      (out += "\\&") += c;
    else
      out += c;
  }
  return out;
}

/// Escapes text for a cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|' || c == '<' || c == '*') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

std::string Command::usage() const {
  std::string text = "counterpoint " + name_;
  for (const auto& option : options_)
    if (option->is_argument() || option->required)
      text += fmt::format(
          " {}", option->required ? option->usage() : fmt::format("[{}]", option->usage()));
  return text + " [OPTIONS]";
}

std::string Command::help(bool all) const {
  std::string text =
      wrapped(description_ + ".", 0, 0) + "\n\n" + wrapped("Usage: " + usage(), 4, 0) + "\n\n";
  int hidden = 0;
  for (const auto& option : options_) {
    if (all || !option->seldom)
      text += entry(option->usage(), option->description);
    else
      ++hidden;
  }
  if (hidden > 0)
    text += entry("--help-all", fmt::format("{} options more, seldom wanted", hidden));
  if (!footer_.empty()) text += "\n" + footer_ + "\n";
  return text;
}

std::string CommandLine::help() const {
  std::string text = description_ + "\n\nUsage: counterpoint COMMAND [OPTIONS]\n\nCommands\n";
  for (const auto& command : commands_) text += entry(command->name(), command->description());
  text += "\nTopics: counterpoint help TOPIC\n";
  for (const Topic& topic : topics_) text += entry(topic.name, topic.description);
  return text + "\n" + footer_ + "\n";
}

std::string CommandLine::bash_completion() const {
  std::string names, topics, options, values;
  for (const Topic& topic : topics_) topics += topic.name + " ";
  for (const auto& command : commands_) {
    names += command->name() + " ";
    options += fmt::format("    {}) options=\"{} \" ;;\n", command->name(),
                           fmt::join(command->option_names(), " "));
    for (const auto& option : command->options_)
      if (!option->words.empty())
        values += fmt::format("    {}:{}) values=\"{}\" ;;\n", command->name(), option->name,
                              fmt::join(option->words, " "));
  }
  std::string script(kBashCompletion);
  for (const auto& [mark, list] :
       {std::pair("@NAMES@", &names), std::pair("@TOPICS@", &topics),
        std::pair("@OPTIONS@", &options), std::pair("@VALUES@", &values)})
    for (size_t at = 0; (at = script.find(mark)) != std::string::npos;)
      script.replace(at, std::string(mark).size(), *list);
  return script;
}

std::string CommandLine::man_page() const {
  std::string text =
      ".TH COUNTERPOINT 1\n.SH NAME\ncounterpoint \\- rigid\\-body physics with convex, smooth, "
      "invertible contact\n.SH SYNOPSIS\n.B counterpoint\nCOMMAND [OPTIONS]\n.SH DESCRIPTION\n" +
      troff(description_) + "\n.SH COMMANDS\n";
  for (const auto& command : commands_) {
    text += fmt::format(".SS {}\n{}.\n.PP\n.B {}\n", troff(command->name()),
                        troff(command->description()), troff(command->usage()));
    for (const auto& option : command->options_)
      text += fmt::format(".TP\n.B {}\n{}\n", troff(option->usage()), troff(option->description));
    if (!command->footer_.empty()) text += ".PP\n.nf\n" + troff(command->footer_) + "\n.fi\n";
  }
  text += ".SH TOPICS\n";
  for (const Topic& topic : topics_)
    text += fmt::format(".SS {}\n.nf\n{}.fi\n", troff(topic.name), troff(topic.text));
  return text + ".SH EXIT STATUS\n0: done. 1: the computation failed. 2: bad input.\n";
}

std::string CommandLine::markdown() const {
  std::string text =
      "# Commands and options\n\nWritten by `counterpoint generate markdown`; the same as "
      "`counterpoint COMMAND --help-all`.\n";
  for (const auto& command : commands_) {
    text += fmt::format("\n## {}\n\n{}.\n\n    {}\n\n| option | meaning |\n|---|---|\n",
                        command->name(), command->description(), command->usage());
    for (const auto& option : command->options_)
      text += fmt::format("| `{}` | {} |\n", cell(option->usage()), cell(option->description));
    if (command->footer_.empty()) continue;
    text += "\n";
    std::istringstream lines(command->footer_);
    for (std::string line; std::getline(lines, line);)
      text += line.rfind("  ", 0) == 0 ? "    " + line.substr(2) + "\n" : line + "\n\n";
  }
  return text;
}

}  // namespace counterpoint::apps
