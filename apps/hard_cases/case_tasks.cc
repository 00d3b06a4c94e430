#include "case_tasks.h"

#include <fmt/format.h>

#include <limits>
#include <sstream>

#include "peer_search.h"
#include "peers/mujoco.h"
#include "peers/not_expressible.h"
#include "tasks/archive.h"
#include "tasks/fingerprint.h"

namespace counterpoint::apps {

template <class Archive>
void serialize(Archive& a, Curve& c) {
  a(c.name, c.x, c.y, c.marks, c.line, c.remarks, c.band);
}
template <class Archive>
void serialize(Archive& a, Level& level) {
  a(level.name, level.y);
}
template <class Archive>
void serialize(Archive& a, Chart& c) {
  a(c.title, c.x_label, c.y_label, c.log_x, c.log_y, c.legend_beside, c.curves, c.levels);
}

namespace {

void keep_files(const CaseSettings& settings, const HardCase& hard_case, Trial& trial) {
  if (!settings.folder.empty())
    trial.keep_state_in(settings.folder / (hard_case.name + ".state.csv"));
  if (settings.views) trial.keep_replay_in(settings.folder / (hard_case.name + ".html"));
}

/// Runs a case on Counterpoint, or with `peer` on MuJoCo with these settings. @throws Stopped
Run run_once(Engine engine, const std::optional<peers::MujocoSettings>& peer,
             const HardCase& hard_case, const CaseSettings& settings) {
  const double allowed = peer ? settings.peer_seconds : std::numeric_limits<double>::infinity();
  Run run{engine};
  if (peer) run.setting = words(*peer);
  Trial trial(settings.scenes, peer, allowed);
  trial.stop_when(settings.stop);
  if (!peer) keep_files(settings, hard_case, trial);
  trial.chart.title = hard_case.name;
  const double start = wall_seconds();
  try {
    hard_case.run(trial);
    if (trial.checks.empty()) run.failure = "nothing was measured";
  } catch (const Stopped&) {
    throw;
  } catch (const peers::NotExpressible& reason) {
    run.lacking = reason.what();
  } catch (const std::exception& error) {
    run.failure = error.what();
  }
  run.wall_seconds = wall_seconds() - start;
  try {
    run.replay = trial.write_replay();
  } catch (const InputError& error) {  // does not fail the case
    fmt::print(stderr, "note: {}: no replay: {}\n", hard_case.name, error.what());
  }
  run.figures = std::move(trial);
  return run;
}

/// @throws Stopped
Run run_on(Engine engine, const HardCase& hard_case, const CaseSettings& settings) {
  using peers::MujocoSettings;
  if (engine == Engine::kCounterpoint) return run_once(engine, {}, hard_case, settings);
  const auto with = [&](const MujocoSettings& peer) {
    return run_once(engine, peer, hard_case, settings);
  };
  if (engine == Engine::kMujocoDefault) return with(MujocoSettings::kDefault);
  constexpr double kRunsOfSearch = 10.0;  // that may take as long as they are allowed to
  return settings.search ? search_settings(with, kRunsOfSearch * settings.peer_seconds)
                         : with(MujocoSettings::kBest);
}

std::uint64_t fingerprint_of(const std::vector<HardCase>& cases, const CaseSettings& settings) {
  tasks::Fingerprint fingerprint;
  for (const HardCase& hard_case : cases) {
    fingerprint.add(std::string_view(hard_case.name));
    std::istringstream scenes(hard_case.scene);  // "a, b"
    for (std::string name; std::getline(scenes >> std::ws, name, ',');)
      fingerprint.add_file(settings.scenes / (name + ".yaml"));
  }
  fingerprint.add(static_cast<int>(settings.engines.size()));
  fingerprint.add(std::string_view(peers::mujoco_version()));
  fingerprint.add(settings.seconds);
  fingerprint.add(settings.peer_seconds);
  fingerprint.add(static_cast<int>(settings.search));
  return fingerprint.value();
}

}  // namespace

tasks::TaskList case_tasks(const std::vector<HardCase>& cases, const CaseSettings& settings) {
  tasks::TaskList list;
  list.name = "hard cases";
  const std::size_t engines = settings.engines.size();
  list.count = static_cast<std::int64_t>(cases.size() * engines);
  list.fingerprint = fingerprint_of(cases, settings);
  list.make_task = [&cases, &settings, engines]() -> tasks::Task {
    return [&cases, &settings, engines](std::int64_t i) {
      const auto number = static_cast<std::size_t>(i);
      try {
        return tasks::Outcome{tasks::to_bytes(run_on(settings.engines[number % engines],
                                                     cases[number / engines], settings)),
                              true};
      } catch (const Stopped&) {
        return tasks::Outcome{{}, false};
      }
    };
  };
  return list;
}

std::vector<Result> case_results(const std::vector<HardCase>& cases, const CaseSettings& settings,
                                 const tasks::Results& results) {
  std::vector<Result> out;
  for (const HardCase& hard_case : cases) out.push_back({hard_case, {}});
  const std::size_t engines = settings.engines.size();
  results.for_each([&](std::int64_t i, std::string&& bytes) {
    if (!bytes.empty())  // empty: it was stopped
      out[static_cast<std::size_t>(i) / engines].runs.push_back(tasks::from_bytes<Run>(bytes));
  });
  std::erase_if(out, [&](const Result& result) { return result.runs.size() < engines; });
  return out;
}

}  // namespace counterpoint::apps
