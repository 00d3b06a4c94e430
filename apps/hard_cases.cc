// counterpoint hard-cases: cases of mechanics that are hard for engines, against what is known of
// them.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

#include "command.h"
#include "hard_cases/chart.h"
#include "hard_cases/trial.h"
#include "report.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> only;
  std::string scenes, folder;
  bool list = false, fast = false;
  Report report;
};

/// A case that has run.
struct Result {
  HardCase hard_case;
  Trial trial;
  std::string failure;  ///< why it did not come to its end, or empty
  double wall_seconds = 0.0;

  bool passed() const {
    return failure.empty() && std::all_of(trial.checks.begin(), trial.checks.end(),
                                          [](const Check& check) { return check.passed(); });
  }
  double newton_mean() const {
    return static_cast<double>(trial.newton_iterations) /
           static_cast<double>(std::max(trial.steps, 1L));
  }
};

std::vector<HardCase> all_cases() {
  std::vector<HardCase> all;
  for (const auto cases : {friction_cases, stacking_cases, masonry_cases, impact_cases, spin_cases,
                           linkage_cases, scale_cases}) {
    for (const HardCase& hard_case : cases()) all.push_back(hard_case);
  }
  return all;
}

std::vector<HardCase> chosen_cases(const Arguments& arguments) {
  std::vector<HardCase> all = all_cases();
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
  for (const char* folder : {COUNTERPOINT_DATA_SOURCE, COUNTERPOINT_DATA_INSTALLED}) {
    if (fs::is_directory(fs::path(folder) / "scenes/hard")) return fs::path(folder) / "scenes/hard";
  }
  throw InputError("the scenes of hard cases are not where they were installed; give --scenes DIR");
}

Result run_case(const HardCase& hard_case, const fs::path& scenes) {
  Result result{hard_case, Trial(scenes), {}, 0.0};
  result.trial.chart.title = hard_case.name;
  const auto start = std::chrono::steady_clock::now();
  try {
    hard_case.run(result.trial);
    if (result.trial.checks.empty()) result.failure = "nothing was measured";
  } catch (const std::exception& error) {
    result.failure = error.what();
  }
  result.wall_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string verdict(const Result& result, bool passed) {
  if (passed) return "pass";
  return result.hard_case.known_failure ? "FAIL (known)" : "FAIL";
}

void print_result(std::FILE* out, const Result& result) {
  const Trial& trial = result.trial;
  fmt::print(out, "{:<22} {:>8} steps, Newton {:.2f} / {}, {:.2f} s: {}\n", result.hard_case.name,
             trial.steps, result.newton_mean(), trial.newton_iterations_max, result.wall_seconds,
             verdict(result, result.passed()));
  for (const Check& check : trial.checks) {
    fmt::print(out, "    {:<44} {:>12.6g} {:<8} {:<24} {}\n", check.quantity, check.measured,
               check.unit, check.known, check.passed() ? "pass" : "FAIL");
  }
  if (!result.failure.empty()) fmt::print(out, "    {}\n", result.failure);
  if (!trial.remark.empty()) fmt::print(out, "    {}\n", trial.remark);
  std::fflush(out);
}

/// For a cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

std::string markdown(const std::vector<Result>& results) {
  std::string out =
      "| case | what is measured | figure | known | source | result | steps | Newton mean / max | "
      "wall [s] |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Result& result : results) {
    std::string first = fmt::format("[{0}]({0}.svg)", result.hard_case.name);
    if (result.trial.chart.empty()) first = result.hard_case.name;
    std::string last =
        fmt::format("{} | {:.2f} / {} | {:.2f}", result.trial.steps, result.newton_mean(),
                    result.trial.newton_iterations_max, result.wall_seconds);
    for (const Check& check : result.trial.checks) {
      out += fmt::format("| {} | {} | {:.6g} {} | {} | {} | {} | {} |\n", first,
                         cell(check.quantity), check.measured, check.unit, check.known,
                         cell(check.source), verdict(result, check.passed()), last);
      first.clear();
      last = "| |";
    }
    if (!result.failure.empty()) {
      out += fmt::format("| {} | {} | | | | {} | {} |\n", first, cell(result.failure),
                         verdict(result, false), last);
    }
  }
  out += "\n## What makes them hard\n\n";
  for (const Result& result : results) {
    const HardCase& c = result.hard_case;
    out += fmt::format("* **{}** ({}{}): {}", c.name, c.scene, c.slow ? "; slow" : "", c.hard);
    if (!result.trial.remark.empty()) out += " " + result.trial.remark;
    if (c.known_failure != nullptr) out += fmt::format(" *Known failure:* {}", c.known_failure);
    out += "\n";
  }
  return out;
}

void write_file(const fs::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text << std::flush;
  if (!stream) {
    throw InputError(
        fmt::format("{}: cannot be written; expected a writable folder", file.string()));
  }
}

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_case(const Result& result) {
  Json entry;
  entry["name"] = result.hard_case.name;
  entry["hard"] = result.hard_case.hard;
  entry["scene"] = result.hard_case.scene;
  entry["slow"] = result.hard_case.slow;
  entry["status"] = result.passed() ? "passed" : "failed";
  if (result.hard_case.known_failure) entry["known_failure"] = result.hard_case.known_failure;
  if (!result.failure.empty()) entry["message"] = result.failure;
  if (!result.trial.remark.empty()) entry["remark"] = result.trial.remark;
  Json checks = Json::array();
  for (const Check& check : result.trial.checks) {
    checks.push_back({{"quantity", check.quantity},
                      {"unit", check.unit},
                      {"measured", json_number(check.measured)},
                      {"lower", json_number(check.lower)},
                      {"upper", json_number(check.upper)},
                      {"source", check.source},
                      {"passed", check.passed()}});
  }
  entry["checks"] = checks;
  entry["steps"] = result.trial.steps;
  entry["newton_iterations_mean"] = result.newton_mean();
  entry["newton_iterations_max"] = result.trial.newton_iterations_max;
  entry["max_penetration_m"] = result.trial.max_penetration;
  entry["wall_seconds"] = result.wall_seconds;
  return entry;
}

int list_cases(const std::vector<HardCase>& cases) {
  for (const HardCase& c : cases)
    fmt::print("{:<22} {}{}\n", c.name, c.slow ? "(slow) " : "", c.hard);
  return kSuccess;
}

int hard_cases(Arguments& arguments) {
  const std::vector<HardCase> cases = chosen_cases(arguments);
  if (arguments.list) return list_cases(cases);
  const fs::path scenes = scene_folder(arguments);
  if (!arguments.folder.empty()) {
    std::error_code error;
    fs::create_directories(arguments.folder, error);
    if (error) {
      throw InputError(fmt::format("--report {}: the folder cannot be made", arguments.folder));
    }
  }
  Report& report = arguments.report;
  report.begin("hard-cases", scenes.string());
  std::vector<Result> results;
  for (const HardCase& c : cases) {
    results.push_back(run_case(c, scenes));
    print_result(report.text(), results.back());
  }
  const auto failed = std::count_if(results.begin(), results.end(),
                                    [](const Result& result) { return !result.passed(); });
  fmt::print(report.text(), "{} of {} cases passed\n", results.size() - failed, results.size());
  if (!arguments.folder.empty()) {
    const fs::path folder = arguments.folder;
    write_file(folder / "hard-cases.md", markdown(results));
    for (const Result& result : results) {
      if (result.trial.chart.empty()) continue;
      write_file(folder / (std::string(result.hard_case.name) + ".svg"), svg(result.trial.chart));
    }
  }
  report["status"] = failed == 0 ? "ok" : "failed";
  report["failed"] = failed;
  Json entries = Json::array();
  for (const Result& result : results) entries.push_back(json_case(result));
  report["cases"] = entries;
  report.write();
  return failed == 0 ? kSuccess : kFailed;
}

}  // namespace

void add_hard_cases(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "hard-cases", "Run cases that are hard for engines; compare with what is known");
  command.add_option("--only", arguments->only, "Run this case; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command.add_flag("--list", arguments->list, "List the cases, run none");
  command.add_flag("--fast", arguments->fast, "Leave the slow ones out");
  command.add_option("--report", arguments->folder, "Write hard-cases.md and one picture a case")
      ->type_name("DIR");
  command.add_option("--scenes", arguments->scenes, "Their scenes; default: data/scenes/hard")
      ->type_name("DIR");
  arguments->report.add_to(command);
  command.footer("Example:\n  counterpoint hard-cases --only tower_30 --report report");
  command.callback(
      [arguments, &action] { action = [arguments] { return hard_cases(*arguments); }; });
}

}  // namespace counterpoint::apps
