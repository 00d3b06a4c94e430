// counterpoint list: lists the bundled data. counterpoint generate: generates texts from the
// command's options.
#include <fmt/format.h>

#include <algorithm>

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
                           {"retarget", "scenes/retarget", ".yaml"},
                           {"control", "scenes/control", ".yaml"},
                           {"maps", "maps", ".yaml"},
                           {"studies", "studies", ".yaml"}};

bool is_within(const std::string& folder, const std::string& path) {
  return path.rfind(folder, 0) == 0;
}

/// True for a file in a folder of problems, which are listed by their own word.
bool has_own_kind(const std::string& path) {
  return std::any_of(std::begin(kKinds), std::end(kKinds), [&](const Kind& kind) {
    return is_within("scenes/", kind.folder) && is_within(kind.folder + std::string("/"), path);
  });
}

struct ListArguments {
  std::string kind;
  bool all = false;
};

int list(const ListArguments& arguments) {
  const bool scenes = arguments.kind == "scenes";
  for (const Kind& kind : kKinds) {
    if (arguments.kind != kind.word) continue;
    const bool problems = is_within("scenes/", kind.folder);
    for (const Bundled& bundled : bundled_in(kind.folder, kind.ending)) {
      const bool nested = bundled.name.find('/') != std::string::npos;
      if (nested && (problems || !arguments.all)) continue;
      if (scenes && has_own_kind("scenes/" + bundled.name)) continue;
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
  auto [command, arguments] =
      line.add<ListArguments>("list", "List what comes with the command, by the names it takes",
                              "Example:\n  counterpoint list scenes\n  counterpoint simulate "
                              "humanoid_drop --view fall.html",
                              list);
  command.add(
      "KIND scenes|robots|problems|retarget|control|studies|maps", arguments.kind,
      "scenes, robots, problems (of optimize), retarget, control (problems of them), studies (of "
      "sweep) or maps",
      required);
  command.add("--all", arguments.all, "Those in folders too: hard/arch_falls");
}

void add_generate(CommandLine& line) {
  auto [command, what] = line.add<std::string>(
      "generate", "Print a text made from the options of all commands",
      "Example:\n  source <(counterpoint generate bash)", [&line](const std::string& kind) {
        fmt::print("{}", kind == "bash"  ? line.bash_completion()
                         : kind == "man" ? line.man_page()
                                         : line.markdown());
        return kSuccess;
      });
  command.add(
      "WHAT bash|man|markdown", what,
      "bash: a completion script; man: the manual page; markdown: docs/reference/options.md",
      required);
}

}  // namespace counterpoint::apps
