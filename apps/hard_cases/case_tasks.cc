#include "case_tasks.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <sstream>

#include "peers/mujoco.h"
#include "peers/not_expressible.h"
#include "tasks/fingerprint.h"
#include "tasks/task_list.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

using tasks::BytesReader;
using tasks::BytesWriter;

void put_chart(BytesWriter& out, const Chart& chart) {
  out.text(chart.title).text(chart.x_label).text(chart.y_label);
  out.put(chart.log_x).put(chart.log_y).put(chart.legend_beside);
  out.list(chart.curves, [](BytesWriter& w, const Curve& curve) {
    w.text(curve.name).numbers(curve.x).numbers(curve.y).put(curve.marks).put(curve.line);
    w.list(curve.remarks, [](BytesWriter& words, const std::string& word) { words.text(word); });
  });
  out.list(chart.levels,
           [](BytesWriter& w, const Level& level) { w.text(level.name).put(level.y); });
}

Chart get_chart(BytesReader& in) {
  Chart chart;
  chart.title = in.text();
  chart.x_label = in.text();
  chart.y_label = in.text();
  chart.log_x = in.get<bool>();
  chart.log_y = in.get<bool>();
  chart.legend_beside = in.get<bool>();
  chart.curves = in.list([](BytesReader& r) {
    Curve curve;
    curve.name = r.text();
    curve.x = r.numbers();
    curve.y = r.numbers();
    curve.marks = r.get<bool>();
    curve.line = r.get<bool>();
    curve.remarks = r.list([](BytesReader& words) { return words.string(); });
    return curve;
  });
  chart.levels = in.list([](BytesReader& r) {
    Level level{r.string(), 0.0};
    level.y = r.get<double>();
    return level;
  });
  return chart;
}

std::string bytes_of(const Run& run) {
  const Trial& trial = run.trial;
  BytesWriter out;
  out.text(run.failure).text(run.lacking).put(run.wall_seconds).put(run.replay);
  out.list(trial.checks, [](BytesWriter& w, const Check& check) {
    w.text(check.quantity).text(check.unit).put(check.measured).put(check.lower).put(check.upper);
    w.text(check.known).text(check.source);
  });
  out.text(trial.remark).put(trial.steps).put(trial.iterations).put(trial.iterations_max);
  out.put(trial.max_penetration);
  put_chart(out, trial.chart);
  return out.take();
}

Run run_of(Engine engine, const std::string& bytes) {
  Run run{engine, Trial({}, engine), {}, {}, 0.0};
  BytesReader in(bytes);
  run.failure = in.text();
  run.lacking = in.text();
  run.wall_seconds = in.get<double>();
  run.replay = in.get<bool>();
  Trial& trial = run.trial;
  trial.checks = in.list([](BytesReader& r) {
    Check check;
    check.quantity = r.text();
    check.unit = r.text();
    check.measured = r.get<double>();
    check.lower = r.get<double>();
    check.upper = r.get<double>();
    check.known = r.text();
    check.source = r.text();
    return check;
  });
  trial.remark = in.text();
  trial.steps = in.get<long>();
  trial.iterations = in.get<long>();
  trial.iterations_max = in.get<long>();
  trial.max_penetration = in.get<double>();
  trial.chart = get_chart(in);
  return run;
}

void keep_files(const CaseSettings& settings, const HardCase& hard_case, Trial& trial) {
  if (!settings.folder.empty())
    trial.keep_state_in(settings.folder / (hard_case.name + ".state.csv"));
  if (settings.views) trial.keep_replay_in(settings.folder / (hard_case.name + ".html"));
}

/// @throws Stopped
Run run_on(Engine engine, const HardCase& hard_case, const CaseSettings& settings) {
  const bool ours = engine == Engine::kCounterpoint;
  const double allowed = ours ? std::numeric_limits<double>::infinity() : settings.peer_seconds;
  Run run{engine, Trial(settings.scenes, engine, allowed), {}, {}, 0.0};
  run.trial.stop_when(settings.stop);
  if (ours) keep_files(settings, hard_case, run.trial);
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
  } catch (const InputError& error) {  // does not fail the case
    fmt::print(stderr, "note: {}: no replay: {}\n", hard_case.name, error.what());
  }
  run.trial.unload();
  return run;
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
        return tasks::Outcome{
            bytes_of(run_on(settings.engines[number % engines], cases[number / engines], settings)),
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
  std::vector<std::vector<Run>> runs(cases.size());
  const std::size_t engines = settings.engines.size();
  results.for_each([&](std::int64_t i, std::string&& bytes) {
    const auto number = static_cast<std::size_t>(i);
    if (!bytes.empty())  // empty: it was stopped
      runs[number / engines].push_back(run_of(settings.engines[number % engines], bytes));
  });
  std::vector<Result> out;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    std::vector<Run>& all = runs[i];
    if (all.size() < engines) continue;
    Result result{cases[i], std::move(all.front()), {}};
    for (std::size_t k = 1; k < all.size(); ++k) result.peers.push_back(std::move(all[k]));
    out.push_back(std::move(result));
  }
  return out;
}

}  // namespace counterpoint::apps
