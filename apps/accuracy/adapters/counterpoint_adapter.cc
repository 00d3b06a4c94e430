#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/simulator.h"
#include "stepping_adapter.h"

namespace counterpoint::apps::accuracy {
namespace {

class CounterpointAdapter : public SteppingAdapter {
 public:
  using SteppingAdapter::SteppingAdapter;

 private:
  StepReport step(const State& state, State& next) override {
    return step_forward(model_, setting_.options, setting_.solver, state, input_, workspace_, next);
  }

  Input input_;
};

/// Advances by error-controlled steps (engine/simulator.h); the first step tried is the scene's
/// time step.
class ControlledAdapter : public EngineAdapter {
 public:
  ControlledAdapter(const Scene& scene, const EngineSetting& setting)
      : model_(scene.model), setting_(setting), workspace_(scene.model) {}

  Passage advance(const State& start, double duration) override {
    const double end = start.time + duration;
    double proposal = setting_.options.time_step;
    Passage out;
    out.end = start;
    const double from = thread_seconds();
    while (out.end.time < end) {
      check_stop();
      const ControlledReport report =
          step_controlled(model_, setting_.options, setting_.solver, out.end, input_, end,
                          workspace_, proposal, middle_, next_);
      out.steps += report.evaluations;
      if (!report.succeeded()) {
        out.failure = failure_message(model_, {out.steps, out.end.time, report.second});
        break;
      }
      std::swap(out.end, next_);
    }
    out.seconds = thread_seconds() - from;
    return out;
  }

 private:
  const Model& model_;
  EngineSetting setting_;
  Workspace workspace_;
  Input input_;
  State middle_, next_;
};

}  // namespace

long whole_steps(double duration, double time_step) {
  const double count = duration / time_step;
  const long steps = std::lround(count);
  if (steps < 1 || !(std::abs(count - static_cast<double>(steps)) < 1e-6)) {
    throw InputError(fmt::format("{:.10g} s is not a whole number of time steps of {:.10g} s",
                                 duration, time_step));
  }
  return steps;
}

std::unique_ptr<EngineAdapter> counterpoint_adapter(const Scene& scene,
                                                    const EngineSetting& setting) {
  if (setting.options.step_control) return std::make_unique<ControlledAdapter>(scene, setting);
  return std::make_unique<CounterpointAdapter>(scene, setting);
}

}  // namespace counterpoint::apps::accuracy
