#include "measure/run_outputs.h"

namespace counterpoint::apps {

RunOutputs::RunOutputs(const std::string& file, const view::ViewOption& view, const Scene& scene,
                       const InputColumns& columns) {
  if (!file.empty()) writer = std::make_unique<TrajectoryWriter>(file, scene.model, columns);
  if (view.wanted()) recorder = std::make_unique<view::ClipRecorder>(scene, view.rate(), true);
}

void RunOutputs::step(const State& before, const Input& input, double h, const State& after,
                      const StepReport& report) {
  find_taut_links(after, known.taut_links);
  if (writer) writer->write_step(before, input, h, report.softening, known.taut_links);
  if (!recorder && !sensors) return;
  std::vector<TautLink> links = std::move(known.taut_links);
  known = input;
  known.taut_links = std::move(links);
  known.softening = report.softening;
  known.z = before.z;
  if (recorder) recorder->add_step(before, known, h, after, report.newton_iterations);
  if (sensors) sensors->add_step(before.time, {before.q, before.v, after.q, after.v, known, h});
}

}  // namespace counterpoint::apps
