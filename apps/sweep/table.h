// The table of a study: a row a task, in order of task.
#pragma once

#include <functional>

#include "row.h"
#include "tasks/run_tasks.h"

namespace counterpoint::apps::sweep {

/// What the rows of a table amount to.
struct Summary {
  std::int64_t rows = 0, failed = 0;
  std::vector<std::pair<std::int64_t, std::string>> reasons;  ///< of the first that failed
};

/// Names of the recorded numbers of a row, in their order: what plots may show.
std::vector<std::string> recorded_names(const Study& study);
std::vector<double> recorded_values(const Row& row);

/// Writes the table beside its place, then puts it there at once. `take` sees every row, too.
/// @throws InputError where it cannot be created, std::runtime_error where the disk is full: an
/// earlier table then stays as it was.
Summary write_table(const std::filesystem::path& file, const Study& study,
                    const tasks::Results& results,
                    const std::function<void(std::int64_t, const Row&)>& take);

}  // namespace counterpoint::apps::sweep
