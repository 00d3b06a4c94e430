// Hard cases as tasks: one is a case on one engine.
#pragma once

#include <filesystem>
#include <vector>

#include "tasks/run_tasks.h"
#include "trial.h"

namespace counterpoint::apps {

/// What cases are run with.
struct CaseSettings {
  std::filesystem::path scenes;
  std::vector<Engine> engines;   ///< ours first
  double seconds = 0.0;          ///< simulated, of long runs
  double peer_seconds = 0.0;     ///< wall time of a peer's run of a case, at most
  std::filesystem::path folder;  ///< of last good states and replays; empty: nowhere
  bool views = false;            ///< replays
  bool (*stop)() = nullptr;
};

/// Task i: case i / engines, on engine i % engines. Both arguments must outlive it.
tasks::TaskList case_tasks(const std::vector<HardCase>& cases, const CaseSettings& settings);

/// The cases that were run on all engines, in their order.
std::vector<Result> case_results(const std::vector<HardCase>& cases, const CaseSettings& settings,
                                 const tasks::Results& results);

}  // namespace counterpoint::apps
