#include "optimize/live_search.h"

#include <fmt/format.h>

#include "command_line/interrupt.h"

namespace counterpoint::apps {

namespace opt = optimization;

LiveSearch::LiveSearch(const opt::ProblemFile& file, const std::vector<VectorX>& guess)
    : view_(live::open_search(*file.scene, file.scene_file.string(),
                              {{{"cost", "1"},
                                {"largest violation of conditions", "1"},
                                {"force without a motor", "weights"},
                                {"smoothing", "m"}},
                               false},
                              Interrupt::wanted)) {
  view_->show(0, "guess", 0.0, file.problem.options, guess);
}

void LiveSearch::watch(opt::Settings& settings) {
  settings.watch = [this](const opt::Progress& p, const std::function<opt::Result()>& so_far) {
    view_->add(
        p.iteration, {p.cost, p.violation.max, p.unactuated.max, p.smoothing},
        fmt::format("Newton step {}, stage {}, {:.1f} s", p.iteration, p.stage + 1, p.seconds));
    if (p.step.accepted && view_->due()) {
      const opt::Result result = so_far();
      view_->show(p.iteration, fmt::format("step {}, cost {:.4g}", p.iteration, p.cost), 0.0,
                  result.options, result.q);
    }
    if (view_->stop_wanted()) Interrupt::want();
  };
}

void LiveSearch::end(const OptimizedStart& start) {
  const opt::Result& result = start.result;
  view_->show(result.iterations, fmt::format("result, cost {:.4g}", result.cost), 0.0,
              result.options, result.q);
  view_->end(fmt::format("{}: cost {:.6g} after {} Newton steps", opt::outcome_name(result.outcome),
                         result.cost, result.iterations));
}

}  // namespace counterpoint::apps
