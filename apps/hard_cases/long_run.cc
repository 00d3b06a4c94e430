#include "long_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "input/inputs.h"
#include "mechanisms.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

/// Resident memory of this process [MB]; 0 without /proc.
double resident_megabytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

/// Quantities observed during a run; energy and speed every kEvery steps.
class Watch {
 public:
  static constexpr long kEvery = 20;

  Watch(Trial& trial, Runner& sim, long steps)
      : trial_(trial), sim_(sim), view_(sim), steps_(steps) {
    start_ = view_.energy_with_springs();
    scale_ = view_.energy_scale();
    trial.plot("energy [J]", {{"start", start_}});
  }

  void after_step() {
    // Measured after one-time allocations: workspaces, the largest number of contacts.
    if (count_ == steps_ / 10) memory_ = resident_megabytes();
    if (++count_ % kEvery != 0) return;
    view_.look();
    const double now = view_.energy_with_springs();
    double& most = count_ <= steps_ / 10 ? early_ : late_;
    most = std::max(most, now - start_);
    fastest_ = std::max(fastest_, sim_.state().v.cwiseAbs().maxCoeff());
    finite_ = finite_ && std::isfinite(now) && sim_.state().q.allFinite();
    // Enough points for the picture.
    if (count_ % std::max(steps_ / 2000, 1L) < kEvery) trial_.draw(sim_, now);
  }

  void report(bool driven) {
    trial_.at_most("values that are not finite", "1", finite_ ? 0.0 : 1.0, 0.0, "physics");
    if (driven) {
      // Bound: a free fall within the height of the scene is slower, and so is every driven motion.
      trial_.at_most("fastest coordinate", "m/s|rad/s", fastest_, 1000.0,
                     "it is held by its forces");
    } else {
      trial_.at_most(
          "highest energy after a tenth of the time, over that before", "1",
          (late_ - early_) / scale_, 0.05,
          "nothing drives it; 5 % of kinetic energy at the start and m g 1 m: the scheme swings");
    }
    trial_.at_most("memory gained", "MB", resident_megabytes() - memory_, 1.0,
                   "a step allocates nothing; 1 MB for what this command keeps");
  }

 private:
  Trial& trial_;
  Runner& sim_;
  View view_;
  long steps_ = 0, count_ = 0;
  double start_ = 0.0, scale_ = 1.0, early_ = 0.0, late_ = 0.0, fastest_ = 0.0, memory_ = 0.0;
  bool finite_ = true;
};

void left_for_long(Trial& trial, const std::string& name, double seconds) {
  Runner& sim = trial.load(name);
  Watch watch(trial, sim, std::lround(seconds / sim.options().time_step));
  trial.run(sim, seconds, [&](const Runner&) { watch.after_step(); });
  watch.report(has_drives(sim.model()));
}

void driven_for_long(Trial& trial, const std::string& name, long steps) {
  Runner& sim = trial.load(name);
  const double h = sim.options().time_step;
  // Half of the effort limits and a quarter of the weight, so that the body is thrown about.
  RandomForces random(sim.model(), 0.5, 0.25, 1);
  Watch watch(trial, sim, steps);
  for (long i = 0; i < steps; ++i) {
    sim.input().applied_force.setZero();
    random.add_to(sim.state().time, 1e-6 * h, sim.input().applied_force);
    trial.step(sim);
    watch.after_step();
  }
  watch.report(true);
}

}  // namespace

std::vector<HardCase> long_cases(const fs::path& folder, double seconds) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  const double each = seconds / static_cast<double>(std::max<std::size_t>(names.size(), 1));
  std::vector<HardCase> cases;
  for (const std::string& name : names) {
    cases.push_back({name, fmt::format("{:g} s of it.", each),
                     [name, each](Trial& trial) { left_for_long(trial, name, each); }});
  }
  const long steps = std::lround(1e7 * seconds / kLongRun);
  cases.push_back({"humanoid_random", fmt::format("{} steps under random forces.", steps),
                   [steps](Trial& trial) { driven_for_long(trial, "humanoid_drop", steps); }, false,
                   "humanoid_drop"});
  const auto share =
      static_cast<long>(static_cast<double>(kMechanismStepsADay) * seconds / kLongRun);
  for (const HardCase& mechanism : mechanism_cases("", std::max(share, kMechanismSteps), true))
    cases.push_back(mechanism);
  return cases;
}

}  // namespace counterpoint::apps
