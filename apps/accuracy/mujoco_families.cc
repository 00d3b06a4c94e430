#include "mujoco_families.h"

#include <fmt/format.h>

#include "counterpoint/engine/clocks.h"
#include "peers/mujoco.h"

namespace counterpoint::apps::accuracy {
namespace {

using peers::Mujoco;
using peers::MujocoSettings;

Scene at_step(const Scene& scene, double h) {
  Scene out = scene;
  out.options.time_step = h;
  return out;
}

class MujocoAdapter : public EngineAdapter {
 public:
  /// Settings that depend on the time step are stored in MuJoCo's model, so each time step has its
  /// own model.
  MujocoAdapter(const Scene& scene, MujocoSettings settings, double h)
      : time_step_(h), mujoco_(at_step(scene, h), settings) {}

  Passage advance(const State& start, double duration) override {
    Passage out;
    out.steps = whole_steps(duration, time_step_);
    mujoco_.set_state(start);
    const double from = thread_seconds();
    out.failure = mujoco_.run(out.steps);
    out.seconds = thread_seconds() - from;
    mujoco_.finish_run();
    out.end = mujoco_.state();
    return out;
  }

 private:
  double time_step_;
  Mujoco mujoco_;
};

}  // namespace

void add_mujoco(const Scene& scene, const std::vector<double>& time_steps, bool constrained,
                Families& out) {
  const std::string version = peers::mujoco_version();
  if (version.empty()) {
    out.left_out.emplace_back("mujoco: it was not found when this was built");
    return;
  }
  struct Kind {
    MujocoSettings settings;
    const char* name;
  };
  for (const Kind& kind :
       {Kind{MujocoSettings::kDefault, "default"}, Kind{MujocoSettings::kRungeKutta4, "RK4"},
        Kind{MujocoSettings::kBest, "best"}}) {
    Family family{"mujoco", fmt::format("MuJoCo {} {}", version, kind.name), "time_step_s", {}};
    const auto adapter = [&scene, settings = kind.settings](double h) {
      return std::make_unique<MujocoAdapter>(scene, settings, h);
    };
    for (const double h : time_steps) {
      family.settings.push_back({fmt::format("{}, {}", family.name, seconds_text(h)), h, "",
                                 [adapter, h] { return adapter(h); }});
    }
    family.other_engine = true;
    if (constrained) family.own = adapter;
    out.families.push_back(std::move(family));
  }
}

}  // namespace counterpoint::apps::accuracy
