// counterpoint hard-cases: mechanics problems that are hard for engines, compared with their known
// properties.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "command.h"
#include "command_line/interrupt.h"
#include "hard_cases/case_tasks.h"
#include "hard_cases/long_run.h"
#include "hard_cases/mechanisms.h"
#include "hard_cases/tables.h"
#include "input/data_folder.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/report.h"
#include "tasks/task_arguments.h"
#include "view/replay.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

struct HardCasesArguments {
  std::vector<std::string> only;
  std::string scenes, folder;
  bool views = false, list = false, fast = false, no_peers = false, long_run = false;
  double seconds = kLongRun;
  double peer_seconds = 120.0;
  std::string peers = "fixed";
  tasks::TaskArguments tasks;
  Report report;
};

std::vector<HardCase> all_cases() {
  std::vector<HardCase> all;
  for (const auto cases : {friction_cases, stacking_cases, masonry_cases, impact_cases, spin_cases,
                           linkage_cases, scale_cases, pile_cases, hollow_cases, published_cases}) {
    for (const HardCase& hard_case : cases()) all.push_back(hard_case);
  }
  for (const HardCase& hard_case : mechanism_cases("../", kMechanismSteps, false))
    all.push_back(hard_case);
  return all;
}

std::vector<HardCase> chosen_cases(const HardCasesArguments& arguments, const fs::path& scenes) {
  std::vector<HardCase> all =
      arguments.long_run ? long_cases(scenes, arguments.seconds) : all_cases();
  for (HardCase& c : all)
    if (c.scene.empty()) c.scene = c.name;
  if (arguments.fast) std::erase_if(all, [](const HardCase& c) { return c.slow; });
  if (arguments.only.empty()) return all;
  std::vector<HardCase> chosen;
  for (const std::string& name : arguments.only) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const HardCase& c) { return c.name == name; });
    if (found == all.end()) {
      throw InputError(fmt::format(
          "--only {}: no such case; counterpoint hard-cases --list shows their names", name));
    }
    chosen.push_back(*found);
  }
  return chosen;
}

fs::path scene_folder(const HardCasesArguments& arguments) {
  if (!arguments.scenes.empty()) {
    if (!fs::is_directory(arguments.scenes)) {
      throw InputError(fmt::format("--scenes {}: expected the folder of the scenes of hard cases",
                                   arguments.scenes));
    }
    return arguments.scenes;
  }
  const fs::path scenes = data_folder() / "scenes";
  return arguments.long_run ? scenes : scenes / "hard";
}

/// Writes DIR/replays.html, which links to all replays and shows their curves.
void write_replay_list(const fs::path& folder, const std::vector<Result>& results) {
  HtmlPage page("Hard cases: replays");
  page.paragraph("The first run of each case on Counterpoint, at most 1000 frames of it.");
  for (const Result& result : results) {
    const std::string& name = result.hard_case.name;
    page.heading(name);
    page.paragraph(result.hard_case.hard);
    if (result.ours().replay) page.links({{name + ": to play", name + ".html"}});
    if (!result.ours().figures.chart.empty()) page.picture(svg(result.ours().figures.chart));
  }
  view::write_whole(folder / "replays.html", page.text());
}

int list_cases(const std::vector<HardCase>& cases) {
  for (const HardCase& c : cases)
    fmt::print("{:<22} {}{}\n", c.name, c.slow ? "(slow) " : "", c.hard);
  return kSuccess;
}

void write_pages(const fs::path& folder, const std::vector<Result>& results, bool views) {
  write_file(folder / "hard-cases.md",
             markdown(results) + (views ? "\n[Replays of the cases](replays.html)\n" : ""));
  for (const Result& result : results) {
    if (result.ours().figures.chart.empty()) continue;
    write_file(folder / (result.hard_case.name + ".svg"), svg(result.ours().figures.chart));
  }
  if (views) write_replay_list(folder, results);
}

int finish(const std::vector<Result>& results, const tasks::Results& run, std::size_t count,
           HardCasesArguments& arguments) {
  Report& report = arguments.report;
  for (const Result& result : results) print_result(report.text(), result);
  const bool stopped = results.size() < count;
  const auto failed = std::count_if(results.begin(), results.end(),
                                    [](const Result& result) { return !result.ours().passed(); });
  report.print("{} of {} cases passed\n", results.size() - failed, results.size());
  if (!arguments.folder.empty()) write_pages(arguments.folder, results, arguments.views);
  add_run(run, report);
  report["status"] = stopped ? "stopped" : failed == 0 ? "ok" : "failed";
  report["failed"] = failed;
  Json entries = Json::array();
  for (const Result& result : results) entries.push_back(json_case(result));
  report["cases"] = entries;
  report.write();
  if (stopped)
    return end_stopped(": {} of {} cases were run{}", results.size(), count,
                       arguments.folder.empty() ? "" : "; " + arguments.folder + " has them");
  return failed == 0 ? kSuccess : kFailed;
}

int hard_cases(HardCasesArguments& arguments, tasks::World& world) {
  if (arguments.views && arguments.folder.empty()) throw InputError("--views: give --report DIR");
  if (arguments.views && !view::can_make_pages())
    throw InputError("--views: " + view::why_no_pages());
  CaseSettings settings{scene_folder(arguments),
                        {Engine::kCounterpoint},
                        arguments.seconds,
                        arguments.peer_seconds,
                        arguments.peers == "search",
                        arguments.folder,
                        arguments.views,
                        Interrupt::wanted};
  const std::vector<HardCase> cases = chosen_cases(arguments, settings.scenes);
  if (arguments.list) return list_cases(cases);
  if (!arguments.no_peers && !arguments.long_run)
    settings.engines.insert(settings.engines.end(), {Engine::kMujocoDefault, Engine::kMujocoBest});
  // A long run measures the memory of its process, so it uses one thread.
  if (arguments.long_run) arguments.tasks.set_threads(1);
  if (!arguments.folder.empty()) make_report_folder(arguments.folder);
  arguments.report.begin("hard-cases", settings.scenes.string());
  const Interrupt interrupt;
  const tasks::Results results =
      arguments.tasks.run_last(world, case_tasks(cases, settings), Interrupt::wanted, true);
  Interrupt::end();
  if (!world.is_root()) return kSuccess;
  return finish(case_results(cases, settings, results), results, cases.size(), arguments);
}

}  // namespace

void add_hard_cases(CommandLine& line) {
  auto [command, arguments] = line.add<HardCasesArguments>(
      "hard-cases", "Run cases that are hard for engines; compare with what is known",
      "Example:\n  counterpoint hard-cases --only tower_30 --report report",
      on_every_rank(hard_cases));
  command.add("--only NAME", arguments.only, "Run this case; may be repeated", one_value_each);
  command.add("--list", arguments.list, "List the cases, run none");
  command.add("--fast", arguments.fast, "Leave the slow ones out");
  command.add("--report DIR", arguments.folder,
              "Write hard-cases.md, one picture a case, the last good state of a run that failed");
  command.add("--views", arguments.views,
              "With --report: a replay of each case, DIR/CASE.html, and DIR/replays.html");
  command.add("--scenes DIR", arguments.scenes, "Their scenes; default: data/scenes/hard");
  command.add("--long", arguments.long_run,
              "Instead: every bundled scene for long, the humanoid under random forces, 1e6 steps "
              "of each mechanism; one at a time in each process");
  command.add("--seconds", arguments.seconds,
              "Simulated time of --long; default: 86400, a day, and 1e7 steps of the humanoid",
              positive);
  command.add("--no-peers", arguments.no_peers, "Leave MuJoCo out");
  command.add("--peer-seconds", arguments.peer_seconds,
              "Wall time after which a peer's run of a case is stopped; default: 120", positive);
  command.add("--peers fixed|search", arguments.peers,
              "Settings of MuJoCo best: the same for all cases (default), or those that a search "
              "finds best for each");
  arguments.tasks.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
