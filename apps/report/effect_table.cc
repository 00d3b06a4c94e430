#include "effect_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "progress.h"

namespace counterpoint::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRuns = 5;  ///< runs per measurement; report_costs takes their median

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Records the states of a short run of a scene with these effects on, to time its steps
/// repeatedly.
class ShortRun {
 public:
  ShortRun(const Scene& scene, EffectSet effects) : scene_(scene), next_{0.0, scene.q, scene.v} {
    constexpr double kLongest = 0.1;  // [s] of computing time
    constexpr int kMostSteps = 1000, kFewestSteps = 10;
    Simulator simulator(scene);
    simulator.options().effects = effects;
    const auto start = Clock::now();
    const double steps = std::ceil(scene.options.duration / scene.options.time_step - 1e-6);
    for (int k = 0; k < std::clamp<double>(steps, 1, kMostSteps); ++k) {
      states_.push_back(simulator.state());
      if (!simulator.step().succeeded()) break;
      if (k >= kFewestSteps && seconds_since(start) > kLongest) break;
    }
  }

  int num_steps() const { return static_cast<int>(states_.size()); }
  /// Mean Newton iterations per step of the last time() call.
  double newton_iterations() const { return newton_iterations_; }

  /// Returns the time of all steps with these effects on [s], or nothing if one fails. If `phases`
  /// is given, each step reads the clock ten times.
  std::optional<double> time(EffectSet effects, PhaseTimes* phases = nullptr) {
    SimulationOptions options = scene_.options;
    options.effects = effects;
    Workspace workspace(scene_.model);
    const Input input;
    // The first step allocates the workspace's memory, so it is not timed.
    step_forward(scene_.model, options, {}, states_[0], input, workspace, next_);
    measure_phases(workspace, phases);
    const auto start = Clock::now();
    long iterations = 0;
    for (const State& state : states_) {
      const StepReport step =
          step_forward(scene_.model, options, {}, state, input, workspace, next_);
      if (!step.succeeded()) return {};
      iterations += step.newton_iterations;
    }
    const double seconds = seconds_since(start);
    newton_iterations_ = static_cast<double>(iterations) / num_steps();
    return seconds;
  }

 private:
  const Scene& scene_;
  std::vector<State> states_;
  State next_;
  double newton_iterations_ = 0.0;
};

struct Phase {
  const char* name;
  double PhaseTimes::*seconds;
};
constexpr Phase kPhases[] = {
    {"poses, contacts", &PhaseTimes::contacts},
    {"smooth dynamics", &PhaseTimes::dynamics},
    {"contact problem", &PhaseTimes::constraints},
    {"recovery of overlaps", &PhaseTimes::overlaps},
};

bool per_contact(Effect effect) {
  return effect == Effect::kContacts || effect == Effect::kFriction ||
         effect == Effect::kTorsionalFriction || effect == Effect::kRollingFriction;
}

}  // namespace

void report_costs(const Scene& scene, const std::vector<EffectUse>& uses, Report& report) {
  fmt::print(report.text(), "\n{:<24} {:>10} {:>13}\n", "effects, added up", "us a step",
             "Newton steps");
  Json costs = Json::array();
  EffectSet effects;
  const auto on = std::count_if(uses.begin(), uses.end(), [](const EffectUse& u) { return u.on; });
  Progress progress("timing effects", kRuns * (static_cast<int>(on) + 1));
  int done = 0;
  const auto measure = [&](const std::string& name) {
    ShortRun run(scene, effects);
    std::vector<double> times;
    for (int i = 0; i < kRuns; ++i) {
      if (const auto time = run.time(effects)) times.push_back(*time);
      progress.update(kRuns * done + i + 1);
    }
    ++done;
    progress.wipe();
    std::optional<double> microseconds;
    if (times.size() == kRuns) {
      std::nth_element(times.begin(), times.begin() + kRuns / 2, times.end());
      microseconds = 1e6 * times[kRuns / 2] / run.num_steps();
    }
    fmt::print(report.text(), "{:<24} {:>10} {:>13}\n", name,
               microseconds ? fmt::format("{:.3g}", *microseconds) : "fails",
               microseconds ? fmt::format("{:.3g}", run.newton_iterations()) : "");
    costs.push_back(
        {{"added", name},
         {"step_us", microseconds ? Json(*microseconds) : Json(nullptr)},
         {"newton_iterations_mean", microseconds ? Json(run.newton_iterations()) : Json(nullptr)}});
  };
  measure("bodies and joints alone");
  for (const EffectUse& use : uses) {
    if (!use.on) continue;
    effects.set(use.effect, true);
    measure(fmt::format("+ {}", effect_name(use.effect)));
  }
  report["costs"] = costs;
}

void report_effects(const std::vector<EffectUse>& uses, Report& report) {
  Json effects = Json::array();
  fmt::print(report.text(), "\n{:<20} {:<4} {:>10}  {}\n", "effect", "", "rows", "why");
  for (const EffectUse& use : uses) {
    const std::string rows = use.rows == 0             ? ""
                             : per_contact(use.effect) ? fmt::format("{} a point", use.rows)
                                                       : std::to_string(use.rows);
    fmt::print(report.text(), "{:<20} {:<4} {:>10}  {}\n", effect_name(use.effect),
               use.on ? "on" : "off", rows, use.why);
    effects.push_back({{"name", effect_name(use.effect)},
                       {"called_for", use.called_for},
                       {"on", use.on},
                       {"why", use.why},
                       {"rows", use.rows},
                       {"rows_at_each_contact_point", per_contact(use.effect)}});
  }
  report["effects"] = effects;
}

void report_phases(const Scene& scene, Report& report) {
  // Sleeping trees cost nothing, so all are kept awake for this measurement.
  const EffectSet awake = scene.options.effects.without({Effect::kSleeping});
  ShortRun run(scene, scene.options.effects);
  PhaseTimes times;
  for (int i = 0; i < kRuns; ++i)
    if (!run.time(awake, &times)) return;
  if (!(times.step > 0.0)) return;
  Json phases = Json::array();
  fmt::print(report.text(), "\n{:<24} {:>10} {:>8}\n", "phase of a step", "us", "share");
  const auto add = [&](const char* name, double seconds) {
    const double microseconds = 1e6 * seconds / (kRuns * run.num_steps()),
                 share = seconds / times.step;
    fmt::print(report.text(), "{:<24} {:>10.3g} {:>6.0f} %\n", name, microseconds, 100.0 * share);
    phases.push_back({{"name", name}, {"step_us", microseconds}, {"share_of_step_time", share}});
  };
  double rest = times.step;
  for (const Phase& phase : kPhases) {
    add(phase.name, times.*phase.seconds);
    rest -= times.*phase.seconds;
  }
  add("integration, checks", rest);
  fmt::print(report.text(), "timed in {} steps of a short run\n", kRuns * run.num_steps());
  report["phases"] = phases;
}

}  // namespace counterpoint::apps
