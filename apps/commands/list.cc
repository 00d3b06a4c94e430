// counterpoint list: lists the bundled data. counterpoint generate: generates texts from the
// command's options.
#include <fmt/format.h>

#include <memory>

#include "command.h"
#include "counterpoint/model/spatial.h"
#include "input/data_folder.h"

namespace counterpoint::apps {
namespace {

struct Kind {
  const char *word, *folder, *ending;
};
constexpr Kind kKinds[] = {{"scenes", "scenes", ".yaml"},
                           {"robots", "robots", ".urdf"},
                           {"problems", "scenes/optimize", ".yaml"},
                           {"maps", "maps", ".yaml"},
                           {"studies", "studies", ".yaml"}};

int list(const std::string& word, bool all) {
  for (const Kind& kind : kKinds) {
    if (word != kind.word) continue;
    const bool problems = word == "problems";
    for (const Bundled& bundled : bundled_in(kind.folder, kind.ending)) {
      const bool nested = bundled.name.find('/') != std::string::npos;
      if (nested && (problems || !all)) continue;
      if (word == "scenes" && bundled.name.rfind("optimize/", 0) == 0) continue;
      if (bundled.about.empty())
        fmt::print("{}\n", bundled.name);
      else
        fmt::print("{:<28} {}\n", bundled.name, bundled.about);
    }
  }
  return kSuccess;
}

}  // namespace

void add_list(CommandLine& line) {
  struct Arguments {
    std::string kind;
    bool all = false;
  };
  auto arguments = std::make_shared<Arguments>();
  Command& command = line.add("list", "List what comes with the command, by the names it takes");
  command
      .add_option("KIND", arguments->kind,
                  "scenes, robots, problems (of optimize), studies (of sweep) or maps")
      .required()
      .one_of({"scenes", "robots", "problems", "studies", "maps"});
  command.add_flag("--all", arguments->all, "Those in folders too: hard/arch_falls");
  command.footer(
      "Example:\n  counterpoint list scenes\n  counterpoint simulate humanoid_drop --view "
      "fall.html");
  command.action([arguments] { return list(arguments->kind, arguments->all); });
}

void add_generate(CommandLine& line) {
  auto what = std::make_shared<std::string>();
  Command& command = line.add("generate", "Print a text made from the options of all commands");
  command
      .add_option(
          "WHAT", *what,
          "bash: a completion script; man: the manual page; markdown: docs/reference/options.md")
      .required()
      .one_of({"bash", "man", "markdown"});
  command.footer("Example:\n  source <(counterpoint generate bash)");
  command.action([what, &line] {
    fmt::print("{}", *what == "bash"  ? line.bash_completion()
                     : *what == "man" ? line.man_page()
                                      : line.markdown());
    return kSuccess;
  });
}

}  // namespace counterpoint::apps
