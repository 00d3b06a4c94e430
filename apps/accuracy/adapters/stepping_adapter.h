// Adapter that takes consecutive steps of the setting's time step.
#pragma once

#include <utility>

#include "counterpoint/engine/clocks.h"
#include "engine_adapter.h"
#include "report/failure.h"

namespace counterpoint::apps::accuracy {

class SteppingAdapter : public EngineAdapter {
 public:
  SteppingAdapter(const Scene& scene, const EngineSetting& setting)
      : model_(scene.model), setting_(setting), workspace_(scene.model) {}

  Passage advance(const State& start, double duration) final {
    const long steps = whole_steps(duration, setting_.options.time_step);
    Passage out;
    out.end = start;
    const double from = thread_seconds();
    for (; out.steps < steps; ++out.steps) {
      check_stop();
      const StepReport report = step(out.end, next_);
      if (!report.succeeded()) {
        out.failure = failure_message(model_, {out.steps, out.end.time, report});
        break;
      }
      std::swap(out.end, next_);
    }
    out.seconds = thread_seconds() - from;
    return out;
  }

 protected:
  virtual StepReport step(const State& state, State& next) = 0;

  const Model& model_;
  EngineSetting setting_;
  Workspace workspace_;

 private:
  State next_;
};

}  // namespace counterpoint::apps::accuracy
