#include "input/motion.h"

#include <fmt/format.h>

#include <cstdio>

#include "report/progress.h"

namespace counterpoint::apps {

Trajectory read_motion(const std::string& file, const Model& model) {
  Progress progress("reading " + file, 1);
  return read_trajectory(file, model, [&](int) { progress.show_time(); });
}

std::vector<Recording> read_with_notes(const std::vector<std::string>& files, const ColumnMap& map,
                                       const Scene& scene) {
  std::vector<Recording> recordings = read_all(files, map, scene);
  for (const Recording& one : recordings)
    if (!one.note.empty()) fmt::print(stderr, "note: {}\n", one.note);
  return recordings;
}

}  // namespace counterpoint::apps
