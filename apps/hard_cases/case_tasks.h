// Hard cases as tasks; a task is one case on one engine.
#pragma once

#include <filesystem>
#include <vector>

#include "tasks/run_tasks.h"
#include "trial.h"

namespace counterpoint::apps {

/// Settings of a run of cases.
struct CaseSettings {
  std::filesystem::path scenes;
  std::vector<Engine> engines;   ///< ours first
  double seconds = 0.0;          ///< simulated time of long runs [s]
  double peer_seconds = 0.0;     ///< largest wall time of another engine's run of a case [s]
  bool search = false;           ///< MuJoCo's best settings are searched for each case
  std::filesystem::path folder;  ///< folder for last good states and replays; empty: none
  bool views = false;            ///< write replays
  bool (*stop)() = nullptr;
};

/// Task i is case i / engines on engine i % engines. Both arguments must outlive it.
tasks::TaskList case_tasks(const std::vector<HardCase>& cases, const CaseSettings& settings);

/// Results of the cases that ran on all engines, in order.
std::vector<Result> case_results(const std::vector<HardCase>& cases, const CaseSettings& settings,
                                 const tasks::Results& results);

}  // namespace counterpoint::apps
