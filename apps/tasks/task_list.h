// Lists of tasks (engine/batch.h) under the name that apps have for them, and their shares.
#pragma once

#include <cstdint>

#include "counterpoint/engine/batch.h"

namespace counterpoint::apps::tasks {

using namespace counterpoint::tasks;

/// Share `index` (from 0) of `of`: the tasks whose numbers leave that remainder, so that long and
/// short tasks, which tend to be neighbours, are dealt out evenly.
struct Share {
  std::int64_t index = 0, of = 1;
  bool has(std::int64_t number) const { return number % of == index; }
};

}  // namespace counterpoint::apps::tasks
