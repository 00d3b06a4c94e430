#include "runner.h"

#include <utility>

#include "counterpoint/engine/simulator.h"
#include "peers/mujoco.h"
#include "report/failure.h"

namespace counterpoint::apps {
namespace {

class CounterpointRunner : public Runner {
 public:
  explicit CounterpointRunner(Scene scene) : sim_(std::move(scene)) {}
  const Scene& scene() const override { return sim_.scene(); }
  void set_time_step(double h) override { sim_.options().time_step = h; }
  const State& state() const override { return sim_.state(); }
  Input& input() override { return sim_.input(); }
  void reset() override { sim_.reset(); }

  StepMetrics step() override {
    before_ = sim_.state();
    const StepReport report = sim_.step();
    softening_ = report.softening;
    StepMetrics out{report.newton_iterations, report.max_penetration, {}};
    if (!report.succeeded()) out.failure = why_failed(sim_.model(), report);
    return out;
  }

  Forces forces() override {
    Input& input = sim_.input();
    input.softening = softening_;
    find_taut_links(sim_.state(), input.taut_links);
    const Inverse& inverse = sim_.inverse(before_.q, before_.v, sim_.state().q, sim_.state().v);
    input.softening = {};
    input.taut_links.clear();
    const double off = (inverse.applied_force - input.applied_force).cwiseAbs().maxCoeff();
    return {inverse.contacts, inverse.closures, off, inverse.force_scale};
  }

 private:
  Simulator sim_;
  State before_;
  Softening softening_;  ///< softening of the last step
};

class MujocoRunner : public Runner {
 public:
  MujocoRunner(Scene scene, const peers::MujocoSettings& settings)
      : scene_(std::move(scene)), mujoco_(scene_, settings) {
    input_.applied_force = VectorX::Zero(scene_.model.nv());
  }
  const Scene& scene() const override { return scene_; }
  void set_time_step(double h) override {
    scene_.options.time_step = h;
    mujoco_.set_time_step(h);
  }
  const State& state() const override { return mujoco_.state(); }
  Input& input() override { return input_; }
  void reset() override { mujoco_.set_state({0.0, scene_.q, scene_.v}); }

  StepMetrics step() override {
    peers::MujocoStep report = mujoco_.step(input_);
    return {report.iterations, report.max_penetration, std::move(report.failure)};
  }

  Forces forces() override { return {mujoco_.contacts(), mujoco_.closures()}; }

 private:
  Scene scene_;
  Input input_;
  peers::Mujoco mujoco_;
};

}  // namespace

const char* engine_name(Engine engine) {
  constexpr const char* kNames[] = {"Counterpoint", "MuJoCo default", "MuJoCo best"};
  return kNames[static_cast<int>(engine)];
}

std::unique_ptr<Runner> make_runner(Scene scene, const std::optional<peers::MujocoSettings>& peer) {
  if (!peer) return std::make_unique<CounterpointRunner>(std::move(scene));
  return std::make_unique<MujocoRunner>(std::move(scene), *peer);
}

}  // namespace counterpoint::apps
