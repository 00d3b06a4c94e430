// counterpoint hard-cases: cases of mechanics that are hard for engines, against what is known of
// them.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <memory>

#include "command.h"
#include "hard_cases/long_run.h"
#include "hard_cases/mechanisms.h"
#include "hard_cases/tables.h"
#include "hard_cases/trial.h"
#include "input/data_folder.h"
#include "interrupt.h"
#include "peers/not_expressible.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/progress.h"
#include "report/report.h"
#include "view/replay.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> only;
  std::string scenes, folder;
  bool views = false, list = false, fast = false, no_peers = false, long_run = false;
  double seconds = kLongRun;
  double peer_seconds = 120.0;
  Report report;
};

std::vector<HardCase> all_cases() {
  std::vector<HardCase> all;
  for (const auto cases : {friction_cases, stacking_cases, masonry_cases, impact_cases, spin_cases,
                           linkage_cases, scale_cases, pile_cases}) {
    for (const HardCase& hard_case : cases()) all.push_back(hard_case);
  }
  for (const HardCase& hard_case : mechanism_cases("../", kMechanismSteps, false))
    all.push_back(hard_case);
  return all;
}

std::vector<HardCase> chosen_cases(const Arguments& arguments, const fs::path& scenes) {
  std::vector<HardCase> all =
      arguments.long_run ? long_cases(scenes, arguments.seconds) : all_cases();
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

fs::path scene_folder(const Arguments& arguments) {
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

Run run_on(Engine engine, const HardCase& hard_case, const fs::path& scenes, double allowed,
           const fs::path& state_file = {}, const fs::path& replay_file = {}) {
  Run run{engine, Trial(scenes, engine, allowed), {}, {}, 0.0};
  run.trial.stop_when(Interrupt::wanted);
  run.trial.keep_state_in(state_file);
  run.trial.keep_replay_in(replay_file);
  run.trial.chart.title = hard_case.name;
  const auto start = std::chrono::steady_clock::now();
  try {
    hard_case.run(run.trial);
    if (run.trial.checks.empty()) run.failure = "nothing was measured";
  } catch (const Stopped&) {
    throw;
  } catch (const peers::NotExpressible& reason) {
    run.lacking = reason.what();
  } catch (const std::exception& error) {
    run.failure = error.what();
  }
  run.wall_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  try {
    run.replay = run.trial.write_replay();
  } catch (const InputError& error) {  // no reason to fail a case
    fmt::print(stderr, "note: {}: no replay: {}\n", hard_case.name, error.what());
  }
  run.trial.unload();
  return run;
}

Result run_case(const HardCase& hard_case, const fs::path& scenes, const Arguments& arguments) {
  const fs::path state_file = arguments.folder.empty()
                                  ? fs::path()
                                  : fs::path(arguments.folder) / (hard_case.name + ".state.csv");
  const fs::path replay_file =
      arguments.views ? fs::path(arguments.folder) / (hard_case.name + ".html") : fs::path();
  Result result{hard_case,
                run_on(Engine::kCounterpoint, hard_case, scenes,
                       std::numeric_limits<double>::infinity(), state_file, replay_file),
                {}};
  if (arguments.no_peers || arguments.long_run) return result;
  for (const Engine peer : {Engine::kMujocoDefault, Engine::kMujocoBest})
    result.peers.push_back(run_on(peer, hard_case, scenes, arguments.peer_seconds));
  return result;
}

/// DIR/replays.html, which leads to all of them, with their curves.
void write_replay_list(const fs::path& folder, const std::vector<Result>& results) {
  HtmlPage page("Hard cases: replays");
  page.paragraph("The first run of each case on Counterpoint, at most 1000 frames of it.");
  for (const Result& result : results) {
    const std::string& name = result.hard_case.name;
    page.heading(name);
    page.paragraph(result.hard_case.hard);
    if (result.ours.replay) page.links({{name + ": to play", name + ".html"}});
    if (!result.ours.trial.chart.empty()) page.picture(svg(result.ours.trial.chart));
  }
  view::write_whole(folder / "replays.html", page.text());
}

int list_cases(const std::vector<HardCase>& cases) {
  for (const HardCase& c : cases)
    fmt::print("{:<22} {}{}\n", c.name, c.slow ? "(slow) " : "", c.hard);
  return kSuccess;
}

int hard_cases(Arguments& arguments) {
  if (arguments.views && arguments.folder.empty()) throw InputError("--views: give --report DIR");
  if (arguments.views && !view::can_make_pages())
    throw InputError("--views: " + view::why_no_pages());
  const fs::path scenes = scene_folder(arguments);
  const std::vector<HardCase> cases = chosen_cases(arguments, scenes);
  if (arguments.list) return list_cases(cases);
  if (!arguments.folder.empty()) make_report_folder(arguments.folder);
  Report& report = arguments.report;
  report.begin("hard-cases", scenes.string());
  std::vector<Result> results;
  Progress progress("hard cases", static_cast<int>(cases.size()));
  const Interrupt interrupt;
  try {
    for (const HardCase& c : cases) {
      progress.update(static_cast<int>(results.size()));
      results.push_back(run_case(c, scenes, arguments));
      progress.wipe();
      print_result(report.text(), results.back());
    }
  } catch (const Stopped&) {  // the case under way has no result
  }
  progress.wipe();
  const bool stopped = results.size() < cases.size();
  const auto failed = std::count_if(results.begin(), results.end(),
                                    [](const Result& result) { return !result.ours.passed(); });
  fmt::print(report.text(), "{} of {} cases passed\n", results.size() - failed, results.size());
  if (!arguments.folder.empty()) {
    const fs::path folder = arguments.folder;
    write_file(
        folder / "hard-cases.md",
        markdown(results) + (arguments.views ? "\n[Replays of the cases](replays.html)\n" : ""));
    for (const Result& result : results) {
      if (result.ours.trial.chart.empty()) continue;
      write_file(folder / (result.hard_case.name + ".svg"), svg(result.ours.trial.chart));
    }
    if (arguments.views) write_replay_list(folder, results);
  }
  report["status"] = stopped ? "stopped" : failed == 0 ? "ok" : "failed";
  report["failed"] = failed;
  Json entries = Json::array();
  for (const Result& result : results) entries.push_back(json_case(result));
  report["cases"] = entries;
  report.write();
  if (stopped)
    fmt::print(stderr, "error: stopped by Ctrl-C or SIGTERM: {} of {} cases were run{}\n",
               results.size(), cases.size(),
               arguments.folder.empty() ? "" : "; " + arguments.folder + " has them");
  return failed == 0 && !stopped ? kSuccess : kFailed;
}

}  // namespace

void add_hard_cases(CommandLine& line) {
  auto arguments = std::make_shared<Arguments>();
  Command& command =
      line.add("hard-cases", "Run cases that are hard for engines; compare with what is known");
  command.add_option("--only", arguments->only, "Run this case; may be repeated")
      .type_name("NAME")
      .one_value_each();
  command.add_flag("--list", arguments->list, "List the cases, run none");
  command.add_flag("--fast", arguments->fast, "Leave the slow ones out");
  command
      .add_option(
          "--report", arguments->folder,
          "Write hard-cases.md, one picture a case, the last good state of a run that failed")
      .type_name("DIR");
  command.add_flag("--views", arguments->views,
                   "With --report: a replay of each case, DIR/CASE.html, and DIR/replays.html");
  command.add_option("--scenes", arguments->scenes, "Their scenes; default: data/scenes/hard")
      .type_name("DIR");
  command.add_flag(
      "--long", arguments->long_run,
      "Instead: every bundled scene for long, the humanoid under random forces, 1e6 steps "
      "of each mechanism");
  command
      .add_option("--seconds", arguments->seconds,
                  "Simulated time of --long; default: 86400, a day, and 1e7 steps of the humanoid")
      .positive();
  command.add_flag("--no-peers", arguments->no_peers, "Leave MuJoCo out");
  command
      .add_option("--peer-seconds", arguments->peer_seconds,
                  "Wall time after which a peer's run of a case is stopped; default: 120")
      .positive();
  arguments->report.add_to(command);
  command.footer("Example:\n  counterpoint hard-cases --only tower_30 --report report");
  command.action([arguments] { return hard_cases(*arguments); });
}

}  // namespace counterpoint::apps
