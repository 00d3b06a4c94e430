// One run of a study, and the row of the table that comes of it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study.h"
#include "tasks/task_list.h"

namespace counterpoint::apps::sweep {

/// What is kept of a task: a run that failed keeps what it had reached.
struct Row {
  std::string reason;  ///< why it failed; empty: it did not
  double steps = 0.0, end_time = 0.0;
  std::uint64_t state_hash = 0;
  std::vector<double> state, columns, figures;  ///< NaN: there is none
  bool failed() const { return !reason.empty(); }

  std::string bytes() const;
  static Row of(const std::string& bytes);
};

/// The tasks of a study. `trajectories`: the folder of these, where they are recorded.
tasks::TaskList task_list(const Study& study, const std::filesystem::path& trajectories,
                          bool (*stop)());

/// The trajectory of a task: "000/000123.csv" in the folder, a thousand in each.
std::filesystem::path trajectory_file(const std::filesystem::path& folder, std::int64_t task);

/// Where the study's figures are unknown to the report of `simulate`: an InputError that lists
/// those that there are. Runs one step of the scene.
void check_figures(const Study& study);

}  // namespace counterpoint::apps::sweep
