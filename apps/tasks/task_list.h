// Lists of tasks (engine/tasks.h) in the namespace of the apps, and their shares.
#pragma once

#include <cstdint>

#include "counterpoint/engine/tasks.h"

namespace counterpoint::apps::tasks {

using namespace counterpoint::tasks;

/// Share `index` (from 0) of `of`: tasks whose number modulo `of` is `index`. Long tasks are often
/// neighbours, so this distributes them evenly.
struct Share {
  std::int64_t index = 0, of = 1;
  bool has(std::int64_t number) const { return number % of == index; }
};

}  // namespace counterpoint::apps::tasks
