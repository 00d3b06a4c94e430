#include "tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "peers/mujoco.h"

namespace counterpoint::apps {
namespace {

const char* verdict(const Result& result, bool passed) {
  if (passed) return "pass";
  return result.hard_case.known_failure ? "FAIL (known)" : "FAIL";
}

/// All runs, ours first.
std::vector<const Run*> all_runs(const Result& result) {
  std::vector<const Run*> runs = {&result.ours};
  for (const Run& peer : result.peers) runs.push_back(&peer);
  return runs;
}

/// Checks of a run that reached its end; all engines measure the same quantities.
const std::vector<Check>& rows(const Result& result) {
  for (const Run* run : all_runs(result)) {
    if (run->failure.empty() && run->lacking.empty()) return run->trial.checks;
  }
  return result.ours.trial.checks;
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
  if (i < peer.trial.checks.size()) {
    const Check& check = peer.trial.checks[i];
    return fmt::format("{:.6g} {}", check.measured, check.passed() ? "pass" : "FAIL");
  }
  return i == 0 ? "FAIL: " + cell(peer.failure) : "FAIL";
}

std::string wall(const Result& result) {
  std::string out = fmt::format("{:.2f}", result.ours.wall_seconds);
  for (const Run& peer : result.peers)
    out += peer.lacking.empty() ? fmt::format(" / {:.2f}", peer.wall_seconds) : " / -";
  return out;
}

/// Table rows of one case.
std::string case_rows(const Result& result) {
  const Run& ours = result.ours;
  const std::vector<Check>& all = rows(result);
  std::string out;
  for (std::size_t i = 0; i < std::max<std::size_t>(all.size(), 1); ++i) {
    std::string name, metric, known, source, quantity;
    if (i == 0) {
      name = ours.trial.chart.empty() ? result.hard_case.name
                                      : fmt::format("[{0}]({0}.svg)", result.hard_case.name);
    }
    bool passed = false;
    if (i < all.size()) {
      quantity = cell(all[i].quantity), known = all[i].known, source = cell(all[i].source);
    }
    if (i < ours.trial.checks.size()) {
      const Check& check = ours.trial.checks[i];
      metric = fmt::format("{:.6g} {}", check.measured, check.unit);
      passed = check.passed();
    } else if (i == 0) {
      metric = cell(ours.failure);
    }
    out += fmt::format("| {} | {} | {} | {} | {} | {} |", name, quantity, metric, known, source,
                       verdict(result, passed));
    for (const Run& peer : result.peers) out += fmt::format(" {} |", peer_cell(peer, i));
    if (i == 0) {
      out += fmt::format(" {} | {:.2f} / {} | {} |\n", ours.trial.steps, ours.iterations_mean(),
                         ours.trial.iterations_max, wall(result));
    } else {
      out += " | | |\n";
    }
  }
  return out;
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
  entry["checks"] = json_checks(run.trial.checks);
  entry["steps"] = run.trial.steps;
  entry["newton_iterations_mean"] = run.iterations_mean();
  entry["newton_iterations_max"] = run.trial.iterations_max;
  entry["max_penetration_m"] = run.trial.max_penetration;
  entry["wall_seconds"] = run.wall_seconds;
}

Json json_peer(const Run& run) {
  Json entry;
  entry["name"] = engine_name(run.engine);
  entry["version"] = peers::mujoco_version();
  entry["status"] = !run.lacking.empty() ? "not run" : run.passed() ? "passed" : "failed";
  const std::string& message = run.lacking.empty() ? run.failure : run.lacking;
  if (!message.empty()) entry["message"] = message;
  if (run.lacking.empty()) add_metrics(run, entry);
  return entry;
}

}  // namespace

void print_result(std::FILE* out, const Result& result) {
  const Run& ours = result.ours;
  fmt::print(out, "{:<22} {:>8} steps, Newton {:.2f} / {}, {:.2f} s: {}\n", result.hard_case.name,
             ours.trial.steps, ours.iterations_mean(), ours.trial.iterations_max, ours.wall_seconds,
             verdict(result, ours.passed()));
  const auto print_checks = [out](const Run& run) {
    for (const Check& check : run.trial.checks) {
      fmt::print(out, "    {:<44} {:>12.6g} {:<8} {:<24} {}\n", check.quantity, check.measured,
                 check.unit, check.known, check.passed() ? "pass" : "FAIL");
    }
    if (!run.failure.empty()) fmt::print(out, "    {}\n", run.failure);
  };
  print_checks(ours);
  if (!ours.trial.remark.empty()) fmt::print(out, "    {}\n", ours.trial.remark);
  for (const Run& peer : result.peers) {
    if (!peer.lacking.empty()) {
      fmt::print(out, "  {}: - ({})\n", engine_name(peer.engine), peer.lacking);
      continue;
    }
    fmt::print(out, "  {}, {} iterations at most, {:.2f} s: {}\n", engine_name(peer.engine),
               peer.trial.iterations_max, peer.wall_seconds, peer.passed() ? "pass" : "FAIL");
    print_checks(peer);
  }
  std::fflush(out);
}

std::string markdown(const std::vector<Result>& results) {
  std::string head = "| case | what is measured | figure | known | source | result |";
  std::string rule = "|---|---|---|---|---|---|";
  std::string times = "wall [s]";
  if (!results.empty()) {
    for (const Run& peer : results.front().peers) {
      head += fmt::format(" {} {} |", engine_name(peer.engine), peers::mujoco_version());
      rule += "---|";
      times += fmt::format(" / {}", engine_name(peer.engine));
    }
  }
  std::string out =
      head + " steps | Newton mean / max | " + times + " |\n" + rule + "---|---|---|\n";
  for (const Result& result : results) out += case_rows(result);
  out += "\n## What makes them hard\n\n";
  for (const Result& result : results) {
    const HardCase& c = result.hard_case;
    out += fmt::format("* **{}** ({}{}): {}", c.name, c.scene, c.slow ? "; slow" : "", c.hard);
    if (!result.ours.trial.remark.empty()) out += " " + result.ours.trial.remark;
    if (c.known_failure != nullptr) out += fmt::format(" *Known failure:* {}", c.known_failure);
    out += "\n";
  }
  return out;
}

Json json_case(const Result& result) {
  const Run& ours = result.ours;
  Json entry;
  entry["name"] = result.hard_case.name;
  entry["hard"] = result.hard_case.hard;
  entry["scene"] = result.hard_case.scene;
  entry["slow"] = result.hard_case.slow;
  entry["status"] = ours.passed() ? "passed" : "failed";
  if (result.hard_case.known_failure) entry["known_failure"] = result.hard_case.known_failure;
  if (!ours.failure.empty()) entry["message"] = ours.failure;
  if (!ours.trial.remark.empty()) entry["remark"] = ours.trial.remark;
  add_metrics(ours, entry);
  if (!result.peers.empty()) {
    Json peers = Json::array();
    for (const Run& peer : result.peers) peers.push_back(json_peer(peer));
    entry["peers"] = peers;
  }
  return entry;
}

}  // namespace counterpoint::apps
