#include "input/motion.h"

#include <fmt/format.h>

#include <cstdio>

#include "command_line/interrupt.h"
#include "report/progress.h"

namespace counterpoint::apps {

Trajectory read_motion(const std::string& file, const Model& model) {
  Progress progress("reading " + file, 1);
  return read_trajectory(file, model, [&](int) { progress.show_time(); });
}

MotionPass for_each_step(
    const std::string& label, const Scene& scene, const Trajectory& trajectory,
    const std::vector<double>& lengths,
    const std::function<Fault(int k, const SimulationOptions& options, const Input& known)>& step) {
  SimulationOptions options = scene.options;
  Input known;
  MotionPass pass;
  const Interrupt interrupt;
  Progress progress(label, trajectory.num_steps());
  for (int& k = pass.done; k < trajectory.num_steps() && !Interrupt::wanted(); ++k) {
    options.time_step = lengths[static_cast<std::size_t>(k)];
    trajectory.set_known(scene.model, k, known);
    if (const Fault fault = step(k, options, known); fault.any()) {
      pass.failed = {k, trajectory.time[static_cast<std::size_t>(k)], {}};
      pass.failed->report.status = status_of(fault);
      pass.failed->report.fault = fault;
      return pass;
    }
    progress.update(k + 1);
  }
  Interrupt::end();
  pass.stopped = pass.done < trajectory.num_steps();
  return pass;
}

std::vector<Recording> read_with_notes(const std::vector<std::string>& files, const ColumnMap& map,
                                       const Scene& scene) {
  std::vector<Recording> recordings = read_all(files, map, scene);
  for (const Recording& one : recordings)
    if (!one.note.empty()) fmt::print(stderr, "note: {}\n", one.note);
  return recordings;
}

}  // namespace counterpoint::apps
