#include "runners.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/simulator.h"
#include "peers/mujoco.h"

namespace counterpoint::apps {
namespace {

using peers::Mujoco;
using peers::MujocoMoment;
using peers::MujocoSettings;

constexpr int kChunk = 25;  ///< steps per turn
/// Largest number of velocities that MuJoCo is run with: its time per body grows beyond some
/// hundred.
constexpr int kLargestForPeers = 6000;

/// Largest force that the inverse finds where none was applied, divided by the largest force at
/// work during the whole run (the force of a single step is zero in free flight).
class Unexplained {
 public:
  void add(double found, double scale) {
    found_ = std::max(found_, found);
    scale_ = std::max(scale_, scale);
  }
  double share() const { return scale_ > 0.0 ? found_ / scale_ : 0.0; }

 private:
  double found_ = 0.0, scale_ = 0.0;
};

std::size_t allocated() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

class OurRunner final : public Runner {
 public:
  explicit OurRunner(const Scene& scene)
      : before_(allocated()),
        scene_(scene),
        workspace_(scene_.model),
        input_{VectorX::Zero(scene.model.nv()), {}} {
    // Sleeping is off, so that all bodies are computed, as in MuJoCo by default.
    scene_.options.effects.set(Effect::kSleeping, false);
    reset();
  }
  const char* name() const override { return "counterpoint"; }
  void reset() override { next_ = state_ = {0.0, scene_.q, scene_.v}; }
  void steps(int count) override {
    for (int i = 0; i < count; ++i) {
      if (!try_step()) throw std::runtime_error(failure);
    }
  }
  int record(int count, bool inverse, double limit) override {
    forget();
    states_.assign(1, state_);
    softenings_.clear();
    const double start = thread_seconds();
    int done = 0;
    while (done < count && try_step()) {
      ++done;
      if (memory_ == 0 && done > count / 2)
        memory_ = allocated() - before_ - (inverse ? recorded(done) : 0);
      if (inverse) {
        states_.push_back(state_);
        softenings_.push_back(softening_);
      }
      if (thread_seconds() - start > limit && done < count) {
        failure = fmt::format("{:g} s were over at {:g} s", limit, state_.time);
        break;
      }
    }
    for (int i = 0; inverse && i < done; ++i) {
      inverses(i, 1);
      unexplained_.add(inverse_.applied_force.lpNorm<Eigen::Infinity>(), inverse_.force_scale);
    }
    return done;
  }
  void inverses(int begin, int count) override {
    for (int i = begin; i < begin + count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      known_.softening = softenings_[k];
      find_taut_links(states_[k + 1], known_.taut_links);
      step_inverse(scene_.model, scene_.options, states_[k].q, states_[k].v, states_[k + 1].q,
                   states_[k + 1].v, known_, workspace_, inverse_);
    }
  }
  double inverse_error() const override { return unexplained_.share(); }
  std::size_t memory() const override { return memory_; }

 private:
  std::size_t recorded(int count) const {
    return static_cast<std::size_t>(count) *
           (static_cast<std::size_t>(scene_.model.nq() + scene_.model.nv()) * sizeof(double) +
            sizeof(State) + sizeof(Softening));
  }
  bool try_step() {
    const StepReport report =
        step_forward(scene_.model, scene_.options, settings_, state_, input_, workspace_, next_);
    iterations += report.newton_iterations;
    if (!report.succeeded()) {
      failure = fmt::format("the step at {:g} s failed", state_.time);
      return false;
    }
    penetration = std::max(penetration, report.max_penetration);
    softening_ = report.softening;
    std::swap(state_, next_);
    return true;
  }

  std::size_t before_, memory_ = 0;
  Scene scene_;
  contact::Settings settings_;
  Workspace workspace_;
  Input input_;
  State state_, next_;
  Softening softening_;  ///< softening of the last step
  std::vector<State> states_;
  std::vector<Softening> softenings_;  ///< softening of the step from each state
  Input known_;
  Inverse inverse_;
  Unexplained unexplained_;
};

class MujocoRunner final : public Runner {
 public:
  MujocoRunner(const Scene& scene, MujocoSettings settings)
      : elliptic_(settings.elliptic), start_{0.0, scene.q, scene.v}, mujoco_(scene, settings) {}
  const char* name() const override { return elliptic_ ? "mujoco elliptic" : "mujoco pyramidal"; }
  void reset() override { mujoco_.set_state(start_); }
  void steps(int count) override { check(mujoco_.run(count)); }
  int record(int count, bool inverse, double limit) override {
    forget();
    const double start = thread_seconds();
    int done = 0;
    while (done < count) {
      const peers::MujocoStep step = mujoco_.step({});
      iterations += step.iterations;
      if (!step.failure.empty()) {
        failure = step.failure;
        break;
      }
      ++done;
      penetration = std::max(penetration, step.max_penetration);
      if (thread_seconds() - start > limit && done < count) {
        failure = fmt::format("{:g} s were over", limit);
        break;
      }
    }
    if (inverse) record_inverse(done);
    return done;
  }
  void record_inverse(int count) {
    reset();
    moments_.resize(static_cast<std::size_t>(count));
    for (MujocoMoment& moment : moments_) check(mujoco_.step_from(moment));
    for (int i = 0; i < count; ++i) {
      inverses(i, 1);
      const Mujoco::InverseForces forces = mujoco_.inverse_forces();
      unexplained_.add(forces.applied, forces.scale);
    }
  }
  void inverses(int begin, int count) override {
    mujoco_.run_inverse(moments_.data() + begin, static_cast<std::size_t>(count));
  }
  double inverse_error() const override { return unexplained_.share(); }
  std::size_t memory() const override { return mujoco_.memory(); }

 private:
  static void check(const std::string& failure) {
    if (!failure.empty()) throw std::runtime_error(failure);
  }
  bool elliptic_;
  State start_;
  Mujoco mujoco_;
  std::vector<MujocoMoment> moments_;
  Unexplained unexplained_;
};

}  // namespace

std::unique_ptr<Runner> our_runner(const Scene& scene) {
  return std::make_unique<OurRunner>(scene);
}

namespace {

/// Seconds per step of each runner, for one trajectory that all run in turns of a few steps.
std::vector<double> one_round(const Runners& runners, int steps, const Work& work) {
  std::vector<double> seconds(runners.size(), 0.0);
  for (int done = 0; done < steps; done += kChunk) {
    const int count = std::min(kChunk, steps - done);
    for (std::size_t i = 0; i < runners.size(); ++i) {
      const double start = thread_seconds();
      work(*runners[i], done, count);
      seconds[i] += thread_seconds() - start;
    }
  }
  for (double& s : seconds) s /= steps;
  return seconds;
}

}  // namespace

Timing time_rounds(const Runners& runners, int steps, int rounds, const Work& work) {
  std::vector<std::vector<double>> seconds;
  for (int round = 0; round < rounds; ++round) {
    for (const auto& runner : runners) runner->reset();
    seconds.push_back(one_round(runners, steps, work));
  }
  return medians(seconds);
}

namespace {

void time_them(const Runners& runners, const Wanted& wanted, const std::string& quantity, int nv,
               const Work& work, PeerTable& table) {
  std::vector<double> iterations;
  for (const auto& runner : runners)
    iterations.push_back(static_cast<double>(runner->iterations) / std::max(wanted.steps, 1));
  const Timing timing = time_rounds(runners, wanted.steps, wanted.rounds, work);
  const bool inverse = quantity == "inverse";
  for (std::size_t i = 0; i < runners.size(); ++i)
    table.add({wanted.table, wanted.label, quantity, runners[i]->name(), timing.seconds[i],
               1.0 / timing.ratio[i], inverse ? "unexplained force" : "overlap [m]",
               inverse ? runners[i]->inverse_error() : runners[i]->penetration, nv,
               inverse ? "" : runners[i]->failure,
               inverse ? std::numeric_limits<double>::quiet_NaN() : iterations[i]});
}

/// Makes the runners, ours first. Each records its trajectory before the next is made, because
/// memory is measured as the allocation in between. Returns the number of steps that all of them
/// can do.
int make_runners(const Scene& scene, const Wanted& wanted, Runners& runners) {
  int steps = wanted.steps;
  const auto add = [&](std::unique_ptr<Runner> runner) {
    steps = std::min(steps, runner->record(steps, wanted.inverse, wanted.limit));
    if (!runner->failure.empty())
      fmt::print("{}: {}: {}; {} steps are compared.\n", wanted.label, runner->name(),
                 runner->failure, steps);
    if (steps == 0) throw std::runtime_error(runner->failure);
    runners.push_back(std::move(runner));
  };
  add(our_runner(scene));
  if (peers::mujoco_version().empty()) {
    fmt::print("Skipped: MuJoCo, which was not found when this was built.\n");
  } else if (scene.model.nv() > kLargestForPeers) {
    fmt::print("Skipped: MuJoCo, beyond {} velocities.\n", kLargestForPeers);
  } else {
    for (const MujocoSettings settings : {MujocoSettings::kDefault, MujocoSettings::kElliptic})
      add(std::make_unique<MujocoRunner>(scene, settings));
  }
  return steps;
}

void compare_scene(const Scene& scene, Wanted wanted, PeerTable& table) {
  Runners runners;
  const int asked = wanted.steps;
  wanted.steps = make_runners(scene, wanted, runners);
  // Records again, so that iterations and overlap refer to the steps that are timed.
  for (const auto& runner : runners)
    if (wanted.steps < asked) runner->record(wanted.steps, wanted.inverse, 1e9);
  const int nv = scene.model.nv();
  time_them(
      runners, wanted, "step", nv, [](Runner& runner, int, int count) { runner.steps(count); },
      table);
  if (wanted.inverse)
    time_them(
        runners, wanted, "inverse", nv,
        [](Runner& runner, int begin, int count) { runner.inverses(begin, count); }, table);
  if (wanted.table != "scale") return;
  for (const auto& runner : runners)
    table.add({wanted.table, wanted.label, "memory", runner->name(),
               std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN(),
               "bytes a body", static_cast<double>(runner->memory()) / scene.model.num_joints(), nv,
               ""});
}

}  // namespace

void try_scene(const Scene& scene, const Wanted& wanted, PeerTable& table) {
  fmt::print("{} ...\n", wanted.label);
  std::fflush(stdout);
  try {
    compare_scene(scene, wanted, table);
  } catch (const std::exception& error) {
    fmt::print("Skipped: {}: {}\n", wanted.label, error.what());
  }
}

int steps_of(const Scene& scene, const PeerOptions& options) {
  const double duration = std::min(scene.options.duration, options.duration);
  return static_cast<int>(std::lround(duration / scene.options.time_step));
}

Scene dropped(const std::filesystem::path& urdf) {
  SceneOverrides overrides;
  overrides.base = Base::kFloating;
  overrides.ground = true;
  Scene scene = load_scene(urdf, overrides);
  scene.q[2] += 0.1;
  if (called_for(scene.model, collision::Collider(scene.model)).has(Effect::kRestitution)) {
    scene.options.effects.set(Effect::kRestitution, false);
    fmt::print("{}: without its restitution, which MuJoCo has not.\n", urdf.stem().string());
  }
  return scene;
}

}  // namespace counterpoint::apps
