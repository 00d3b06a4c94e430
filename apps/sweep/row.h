// One run of a study, and its row in the table.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study.h"
#include "tasks/task_list.h"

namespace counterpoint::apps::sweep {

/// Results of a task; a failed run keeps the results that it reached.
struct Row {
  std::string reason;  ///< why it failed; empty: it did not fail
  double steps = 0.0, end_time = 0.0;
  std::uint64_t state_hash = 0;
  std::vector<double> state, columns, metrics;  ///< NaN: not available
  bool failed() const { return !reason.empty(); }

  template <class Archive>
  void serialize(Archive& a) {
    a(reason, steps, end_time, state_hash, state, columns, metrics);
  }
};

/// Tasks of a study. `trajectories`: folder for trajectories, if they are recorded.
tasks::TaskList task_list(const Study& study, const std::filesystem::path& trajectories,
                          bool (*stop)());

/// Path of a task's trajectory: "000/000123.csv" in the folder, a thousand in each subfolder.
std::filesystem::path trajectory_file(const std::filesystem::path& folder, std::int64_t task);

/// Checks the study's figures. @throws InputError that lists the figures in the report of
/// `simulate`, if one is unknown. Creates a simulator of the scene.
void check_metrics(const Study& study);

}  // namespace counterpoint::apps::sweep
