// Steps forward and inverse against MuJoCo's mj_step and mj_inverse: each engine along its own
// trajectory of the same scene, a few steps of one, then of the next.
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/simulator.h"
#include "median.h"
#include "peers/mujoco.h"
#include "tables.h"
#include "timing.h"

namespace counterpoint::apps {
namespace {

using peers::Mujoco;
using peers::MujocoMoment;
using peers::MujocoSettings;

constexpr int kChunk = 25;  ///< steps at a time
/// Velocities up to which MuJoCo is run: its time a body grows beyond some hundred.
constexpr int kLargestForPeers = 6000;

/// One engine on one scene.
class Runner {
 public:
  virtual ~Runner() = default;
  virtual const char* name() const = 0;
  /// Back to the start.
  virtual void reset() = 0;
  /// Without anything between them. @throws std::runtime_error if a step fails.
  virtual void steps(int count) = 0;
  /// Goes through the whole trajectory once and keeps what the inverse needs, and the quality.
  virtual void record(int count) = 0;
  /// Inverse dynamics of recorded steps begin ... begin + count - 1.
  virtual void inverses(int begin, int count) = 0;
  virtual double inverse_error() const = 0;
  virtual std::size_t memory() const = 0;
  double penetration = 0.0;  ///< deepest overlap of the trajectory [m]
};

/// The largest force that the inverse finds where none was applied, over the largest at work in all
/// of the run: in free flight there is none at all.
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
    // What sleeps costs nothing; here all is computed, as MuJoCo does by default.
    scene_.options.effects.set(Effect::kSleeping, false);
    reset();
  }
  const char* name() const override { return "counterpoint"; }
  void reset() override { next_ = state_ = {0.0, scene_.q, scene_.v}; }
  void steps(int count) override {
    for (int i = 0; i < count; ++i) step();
  }
  void record(int count) override {
    reset();
    states_.assign(1, state_);
    for (int i = 0; i < count; ++i) {
      step();
      if (memory_ == 0 && i == count / 2) memory_ = allocated() - before_ - recorded(i + 1);
      states_.push_back(state_);
    }
    for (int i = 0; i < count; ++i) {
      inverses(i, 1);
      unexplained_.add(inverse_.applied_force.lpNorm<Eigen::Infinity>(), inverse_.force_scale);
    }
  }
  void inverses(int begin, int count) override {
    for (int i = begin; i < begin + count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      step_inverse(scene_.model, scene_.options, states_[k].q, states_[k].v, states_[k + 1].q,
                   states_[k + 1].v, Input(), workspace_, inverse_);
    }
  }
  double inverse_error() const override { return unexplained_.share(); }
  std::size_t memory() const override { return memory_; }

 private:
  std::size_t recorded(int count) const {
    return static_cast<std::size_t>(count) *
           (static_cast<std::size_t>(scene_.model.nq() + scene_.model.nv()) * sizeof(double) +
            sizeof(State));
  }
  void step() {
    const StepReport report =
        step_forward(scene_.model, scene_.options, settings_, state_, input_, workspace_, next_);
    if (!report.succeeded())
      throw std::runtime_error(fmt::format("{}: step at {} s failed", scene_.name, state_.time));
    penetration = std::max(penetration, report.max_penetration);
    std::swap(state_, next_);
  }

  std::size_t before_, memory_ = 0;
  Scene scene_;
  contact::Settings settings_;
  Workspace workspace_;
  Input input_;
  State state_, next_;
  std::vector<State> states_;
  Inverse inverse_;
  Unexplained unexplained_;
};

class MujocoRunner final : public Runner {
 public:
  MujocoRunner(const Scene& scene, MujocoSettings settings)
      : elliptic_(settings == MujocoSettings::kElliptic),
        start_{0.0, scene.q, scene.v},
        mujoco_(scene, settings) {}
  const char* name() const override { return elliptic_ ? "mujoco elliptic" : "mujoco pyramidal"; }
  void reset() override { mujoco_.set_state(start_); }
  void steps(int count) override { check(mujoco_.run(count)); }
  void record(int count) override {
    reset();
    for (int i = 0; i < count; ++i) {
      const peers::MujocoStep step = mujoco_.step({});
      check(step.failure);
      penetration = std::max(penetration, step.max_penetration);
    }
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

/// Seconds a step, by runner, of one trajectory gone through by all in turn.
template <class Work>
std::vector<double> one_round(const std::vector<std::unique_ptr<Runner>>& runners, int steps,
                              Work work) {
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

struct Wanted {
  std::string table = "steps", label;
  int steps = 0, rounds = 0;
};

template <class Work>
void time_them(const std::vector<std::unique_ptr<Runner>>& runners, const Wanted& wanted,
               const std::string& quantity, int nv, Work work, PeerTable& table) {
  std::vector<std::vector<double>> seconds(runners.size()), ratio(runners.size());
  for (int round = 0; round < wanted.rounds; ++round) {
    for (const auto& runner : runners) runner->reset();
    const std::vector<double> once = one_round(runners, wanted.steps, work);
    for (std::size_t i = 0; i < runners.size(); ++i) {
      seconds[i].push_back(once[i]);
      ratio[i].push_back(once[0] / once[i]);
    }
  }
  const bool inverse = quantity == "inverse";
  for (std::size_t i = 0; i < runners.size(); ++i)
    table.add({wanted.table, wanted.label, quantity, runners[i]->name(), median(seconds[i]),
               median(ratio[i]), inverse ? "unexplained force" : "overlap [m]",
               inverse ? runners[i]->inverse_error() : runners[i]->penetration, nv, ""});
}

void compare_scene(const Scene& scene, const Wanted& wanted, PeerTable& table) {
  std::vector<std::unique_ptr<Runner>> runners;
  // Each is gone through before the next is made: memory is what was allocated meanwhile.
  runners.push_back(std::make_unique<OurRunner>(scene));
  runners.back()->record(wanted.steps);
  if (peers::mujoco_version().empty()) {
    fmt::print("Skipped: MuJoCo, which was not found when this was built.\n");
  } else if (scene.model.nv() > kLargestForPeers) {
    fmt::print("Skipped: MuJoCo, beyond {} velocities.\n", kLargestForPeers);
  } else {
    for (const MujocoSettings settings : {MujocoSettings::kDefault, MujocoSettings::kElliptic}) {
      runners.push_back(std::make_unique<MujocoRunner>(scene, settings));
      runners.back()->record(wanted.steps);
    }
  }
  const int nv = scene.model.nv();
  time_them(
      runners, wanted, "step", nv, [](Runner& runner, int, int count) { runner.steps(count); },
      table);
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

/// A failure of one scene is said, and the others go on.
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

/// A URDF dropped from 0.1 m above the ground, without restitution, which MuJoCo has not.
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

/// So many of our robots, in rows of ten at most: place(row, size) says where each stands. The
/// ground has their friction: MuJoCo then chooses pairs by itself, without a list of all of them.
template <class Place>
Scene many(const PeerOptions& options, const std::string& robot, double friction, int count,
           Place place) {
  const std::string urdf = (options.scenes / ".." / "robots" / robot).lexically_normal().string();
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("counterpoint_bench_{}.yaml", getpid());
  {
    std::ofstream out(file);
    out << fmt::format("time_step: 0.002\nduration: 2\nground: {{friction: {}}}\nmodels:\n",
                       friction);
    for (int row = 0; row * 10 < count; ++row)
      out << fmt::format("  - {{urdf: {}, name: row{}_, base: floating, {}}}\n", urdf, row,
                         place(row, std::min(10, count - 10 * row)));
  }
  Scene scene = load_scene(file);
  std::filesystem::remove(file);
  return scene;
}

Scene humanoids(const PeerOptions& options, int count) {
  return many(options, "humanoid.urdf", 0.8, count, [](int row, int size) {
    return fmt::format("position: [0, {}, 0.96], count: {}, spacing: [2, 0, 0]", 2 * row, size);
  });
}

/// Columns of ten.
Scene boxes(const PeerOptions& options, int count) {
  return many(options, "cube.urdf", 0.5, count, [](int row, int size) {
    return fmt::format("position: [{:.1f}, {:.1f}, 0.101], count: {}, spacing: [0, 0, 0.201]",
                       0.4 * (row % 16), 0.4 * (row / 16), size);
  });
}

}  // namespace

void compare_steps(const PeerOptions& options, PeerTable& table) {
  for (const char* name : {"humanoid_drop", "stack_5", "pyramid_5", "grid_5", "pack_4"}) {
    const Scene scene = load_scene(options.scenes / (std::string(name) + ".yaml"));
    try_scene(scene, {"steps", name, steps_of(scene, options), options.step_rounds}, table);
  }
  for (const char* name : {"anymal.urdf", "solo12.urdf", "go2.urdf"}) {
    const std::filesystem::path urdf = find_below(options.robots, name);
    if (urdf.empty()) {
      fmt::print("Skipped: {} is not below the folder of robots.\n", name);
      continue;
    }
    const Scene scene = dropped(urdf);
    try_scene(scene, {"steps", urdf.stem().string(), steps_of(scene, options), options.step_rounds},
              table);
  }
}

namespace {

/// Ours in all sizes in turn, a few steps of each: seconds for one of `counts`, and over the first.
void compare_sizes(const char* what, const std::vector<int>& counts, int steps,
                   Scene make(const PeerOptions&, int), const PeerOptions& options,
                   PeerTable& table) {
  std::vector<std::unique_ptr<Runner>> runners;
  for (const int count : counts)
    runners.push_back(std::make_unique<OurRunner>(make(options, count)));
  std::vector<std::vector<double>> seconds(runners.size()), growth(runners.size());
  for (int round = 0; round < options.step_rounds; ++round) {
    for (const auto& runner : runners) runner->reset();
    const std::vector<double> once =
        one_round(runners, steps, [](Runner& runner, int, int count) { runner.steps(count); });
    for (std::size_t i = 0; i < runners.size(); ++i) {
      seconds[i].push_back(once[i] / counts[i]);
      growth[i].push_back(seconds[i].back() / seconds[0].back());
    }
  }
  for (std::size_t i = 0; i < runners.size(); ++i)
    table.add({"growth", fmt::format("{} {}", counts[i], what), "step of one", runners[i]->name(),
               median(seconds[i]), 1.0, "over the first", median(growth[i]), 0, ""});
}

}  // namespace

void compare_scale(const PeerOptions& options, PeerTable& table) {
  const auto rounds = [&](int count, int few) { return count < few ? options.step_rounds : 1; };
  const std::vector<int> humanoid_counts = {1, 4, 22, 100, 300, 1000};
  const std::vector<int> box_counts = {100, 400, 1000, 4000, 10000};
  compare_sizes("humanoids", humanoid_counts, 250, humanoids, options, table);
  compare_sizes("boxes", box_counts, 50, boxes, options, table);
  for (const int count : humanoid_counts)
    try_scene(humanoids(options, count),
              {"scale", fmt::format("{} humanoids", count), 250, rounds(count, 100)}, table);
  for (const int count : box_counts)
    try_scene(boxes(options, count),
              {"scale", fmt::format("{} boxes", count), 50, rounds(count, 1000)}, table);
}

}  // namespace counterpoint::apps
