// Table of a study: one row per task, in order of tasks.
#pragma once

#include <functional>

#include "row.h"
#include "tasks/run_tasks.h"

namespace counterpoint::apps::sweep {

/// Summary of the rows of a table.
struct Summary {
  std::int64_t rows = 0, failed = 0;
  std::vector<std::pair<std::int64_t, std::string>> reasons;  ///< reasons of the first failed tasks
};

/// Names of the recorded values of a row, in order.
std::vector<std::string> recorded_names(const Study& study);
std::vector<double> recorded_values(const Row& row);

/// Writes the table to a temporary file and renames it when complete. `take` is called for every
/// row. @throws InputError if it cannot be created, std::runtime_error if the disk is full; an
/// earlier table then stays unchanged.
Summary write_table(const std::filesystem::path& file, const Study& study,
                    const tasks::Results& results,
                    const std::function<void(std::int64_t, const Row&)>& take);

}  // namespace counterpoint::apps::sweep
