#include "tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "peers/mujoco.h"
#include "report/html_page.h"

namespace counterpoint::apps {
namespace {

const char* verdict(const Result& result, bool passed) {
  if (passed) return "pass";
  return result.hard_case.known_failure ? "FAIL (known)" : "FAIL";
}

/// Checks of a run that reached its end; all engines measure the same quantities.
const std::vector<Check>& rows(const Result& result) {
  const auto run = std::find_if(result.runs.begin(), result.runs.end(),
                                [](const Run& r) { return r.reached_end(); });
  return (run == result.runs.end() ? result.ours() : *run).figures.checks;
}

/// Escapes text for a cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

/// Cell of another engine in row i: its figure, or in row 0 the reason why there is none.
std::string peer_cell(const Run& peer, std::size_t i) {
  if (!peer.lacking.empty()) return i == 0 ? "- (" + cell(peer.lacking) + ")" : "-";
  if (i < peer.figures.checks.size()) {
    const Check& check = peer.figures.checks[i];
    return fmt::format("{:.6g} {}", check.measured, check.passed() ? "pass" : "FAIL");
  }
  if (peer.reached_end()) return "-";  // a figure that it does not have
  return i == 0 ? "FAIL: " + cell(peer.failure) : "FAIL";
}

std::string wall(const Result& result) {
  std::vector<std::string> seconds;
  for (const Run& run : result.runs)
    seconds.push_back(run.engine != Engine::kCounterpoint && !run.lacking.empty()
                          ? "-"
                          : fmt::format("{:.2f}", run.wall_seconds));
  return fmt::format("{}", fmt::join(seconds, " / "));
}

/// Adds the rows of one case.
void add_rows(const Result& result, PageTable& table) {
  const Figures& ours = result.ours().figures;
  const std::vector<Check>& all = rows(result);
  for (std::size_t i = 0; i < std::max<std::size_t>(all.size(), 1); ++i) {
    const bool first = i == 0, measured = i < ours.checks.size();
    std::vector<std::string> row(3);
    if (first)
      row[0] = ours.chart.empty() ? result.hard_case.name
                                  : fmt::format("[{0}]({0}.svg)", result.hard_case.name);
    if (i < all.size()) row[1] = cell(all[i].quantity);
    if (measured)
      row[2] = fmt::format("{:.6g} {}", ours.checks[i].measured, ours.checks[i].unit);
    else if (first)
      row[2] = cell(result.ours().failure);
    row.push_back(i < all.size() ? all[i].known : "");
    row.push_back(i < all.size() ? cell(all[i].source) : "");
    row.push_back(verdict(result, measured && ours.checks[i].passed()));
    for (std::size_t k = 1; k < result.runs.size(); ++k)
      row.push_back(peer_cell(result.runs[k], i));
    row.push_back(first ? fmt::format("{}", ours.steps) : "");
    row.push_back(first ? fmt::format("{:.2f} / {}", ours.iterations_mean(), ours.iterations_max)
                        : "");
    row.push_back(first ? wall(result) : "");
    table.rows.push_back(row);
  }
}

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_checks(const std::vector<Check>& checks) {
  Json out = Json::array();
  for (const Check& check : checks) {
    out.push_back({{"quantity", check.quantity},
                   {"unit", check.unit},
                   {"measured", json_number(check.measured)},
                   {"lower", json_number(check.lower)},
                   {"upper", json_number(check.upper)},
                   {"source", check.source},
                   {"passed", check.passed()}});
  }
  return out;
}

void add_metrics(const Run& run, Json& entry) {
  const Figures& figures = run.figures;
  entry["checks"] = json_checks(figures.checks);
  entry["steps"] = figures.steps;
  entry["newton_iterations_mean"] = figures.iterations_mean();
  entry["newton_iterations_max"] = figures.iterations_max;
  entry["max_penetration_m"] = figures.max_penetration;
  entry["wall_seconds"] = run.wall_seconds;
}

Json json_peer(const Run& run) {
  Json entry;
  entry["name"] = engine_name(run.engine);
  entry["version"] = peers::mujoco_version();
  entry["settings"] = run.setting;
  if (run.tried > 0) entry["settings_tried"] = run.tried;
  entry["status"] = !run.lacking.empty() ? "not run" : run.passed() ? "passed" : "failed";
  const std::string& message = run.lacking.empty() ? run.failure : run.lacking;
  if (!message.empty()) entry["message"] = message;
  if (run.lacking.empty()) add_metrics(run, entry);
  return entry;
}

/// Settings that searches chose, as a section; empty without a search.
std::string chosen_settings(const std::vector<Result>& results) {
  PageTable table{{"case", "settings of MuJoCo best", "tried", "passed"}, {}};
  for (const Result& result : results) {
    for (const Run& run : result.runs) {
      if (run.tried == 0 || !run.lacking.empty()) continue;
      const auto& checks = run.figures.checks;
      const auto passed = std::count_if(checks.begin(), checks.end(),
                                        [](const Check& check) { return check.passed(); });
      table.rows.push_back({result.hard_case.name, run.setting, fmt::format("{}", run.tried),
                            fmt::format("{} of {}", passed, rows(result).size())});
    }
  }
  if (table.rows.empty()) return {};
  return "\n## Settings of MuJoCo best\n\n" + markdown_table(table);
}

}  // namespace

void print_result(std::FILE* out, const Result& result) {
  for (const Run& run : result.runs) {
    const Figures& figures = run.figures;
    const bool ours = run.engine == Engine::kCounterpoint;
    if (ours) {
      fmt::print(out, "{:<22} {:>8} steps, Newton {:.2f} / {}, {:.2f} s: {}\n",
                 result.hard_case.name, figures.steps, figures.iterations_mean(),
                 figures.iterations_max, run.wall_seconds, verdict(result, run.passed()));
    } else if (!run.lacking.empty()) {
      fmt::print(out, "  {}: - ({})\n", engine_name(run.engine), run.lacking);
      continue;
    } else {
      fmt::print(out, "  {} ({}{}), {} iterations at most, {:.2f} s: {}\n", engine_name(run.engine),
                 run.setting, run.tried > 0 ? fmt::format("; {} tried", run.tried) : "",
                 figures.iterations_max, run.wall_seconds, run.passed() ? "pass" : "FAIL");
    }
    for (const Check& check : figures.checks) {
      fmt::print(out, "    {:<44} {:>12.6g} {:<8} {:<24} {}\n", check.quantity, check.measured,
                 check.unit, check.known, check.passed() ? "pass" : "FAIL");
    }
    if (!run.failure.empty()) fmt::print(out, "    {}\n", run.failure);
    if (ours && !figures.remark.empty()) fmt::print(out, "    {}\n", figures.remark);
  }
  std::fflush(out);
}

std::string markdown(const std::vector<Result>& results) {
  PageTable table{{"case", "what is measured", "figure", "known", "source", "result"}, {}};
  std::string times = "wall [s]";
  for (std::size_t k = 1; !results.empty() && k < results.front().runs.size(); ++k) {
    const char* name = engine_name(results.front().runs[k].engine);
    table.header.push_back(fmt::format("{} {}", name, peers::mujoco_version()));
    times += fmt::format(" / {}", name);
  }
  table.header.insert(table.header.end(), {"steps", "Newton mean / max", times});
  for (const Result& result : results) add_rows(result, table);
  std::string out =
      markdown_table(table) + chosen_settings(results) + "\n## What makes them hard\n\n";
  for (const Result& result : results) {
    const HardCase& c = result.hard_case;
    const std::string& remark = result.ours().figures.remark;
    out += fmt::format("* **{}** ({}{}): {}", c.name, c.scene, c.slow ? "; slow" : "", c.hard);
    if (!remark.empty()) out += " " + remark;
    if (c.known_failure != nullptr) out += fmt::format(" *Known failure:* {}", c.known_failure);
    out += "\n";
  }
  return out;
}

Json json_case(const Result& result) {
  const Run& ours = result.ours();
  Json entry;
  entry["name"] = result.hard_case.name;
  entry["hard"] = result.hard_case.hard;
  entry["scene"] = result.hard_case.scene;
  entry["slow"] = result.hard_case.slow;
  entry["status"] = ours.passed() ? "passed" : "failed";
  if (result.hard_case.known_failure) entry["known_failure"] = result.hard_case.known_failure;
  if (!ours.failure.empty()) entry["message"] = ours.failure;
  if (!ours.figures.remark.empty()) entry["remark"] = ours.figures.remark;
  add_metrics(ours, entry);
  for (std::size_t k = 1; k < result.runs.size(); ++k)
    entry["peers"].push_back(json_peer(result.runs[k]));
  return entry;
}

}  // namespace counterpoint::apps
