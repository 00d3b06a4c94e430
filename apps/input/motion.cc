#include "input/motion.h"

#include "report/progress.h"

namespace counterpoint::apps {

Trajectory read_motion(const std::string& file, const Model& model) {
  Progress progress("reading " + file, 1);
  return read_trajectory(file, model, [&](int) { progress.show_time(); });
}

}  // namespace counterpoint::apps
