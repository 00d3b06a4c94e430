// Microseconds per forward step, per inverse step, and per run of each algorithm they are made of.
// Usage: counterpoint_bench [--benchmark_filter=REGEX]; everything is registered in main.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/crba.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/engine/rnea.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenes[] = {"cube_drop",     "pendulum",  "arm7",    "quadruped_drop",
                                   "humanoid_drop", "box_stack", "stack_5", "pyramid_5",
                                   "grid_5",        "pack_4"};
constexpr const char* kTrees[] = {"arm7", "quadruped_drop", "humanoid_drop"};

/// A scene and its states over the scene's duration: what steps are timed on, impacts and rest
/// alike.
struct Rollout {
  explicit Rollout(const std::string& name)
      : scene(load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"))) {
    Simulator simulator(scene);
    states.push_back(simulator.state());
    while (simulator.state().time < scene.options.duration) {
      const StepReport report = simulator.step();
      if (!report.succeeded()) {
        throw std::runtime_error(fmt::format("{}: step at {} s: {}", name, simulator.state().time,
                                             contact::status_name(report.status)));
      }
      contacts += report.contacts;
      iterations += report.newton_iterations;
      states.push_back(simulator.state());
    }
  }
  size_t num_steps() const { return states.size() - 1; }

  Scene scene;
  std::vector<State> states;
  double contacts = 0.0, iterations = 0.0;
};

void label(benchmark::State& run, const Rollout& rollout) {
  const double steps = static_cast<double>(rollout.num_steps());
  run.counters["nv"] = rollout.scene.model.nv();
  run.counters["contacts"] = rollout.contacts / steps;
  run.counters["newton"] = rollout.iterations / steps;
}

/// One iteration is one step; the states of the rollout are gone through in turn.
void forward_step(benchmark::State& run, const std::string& name) {
  const Rollout rollout(name);
  const Model& model = rollout.scene.model;
  Workspace workspace(model);
  const contact::Settings settings;
  const Input input{VectorX::Zero(model.nv()), {}};
  State next = rollout.states[0];
  size_t k = 0;
  for (auto _ : run) {
    benchmark::DoNotOptimize(step_forward(model, rollout.scene.options, settings, rollout.states[k],
                                          input, workspace, next));
    if (++k == rollout.num_steps()) k = 0;
  }
  label(run, rollout);
}

void inverse_step(benchmark::State& run, const std::string& name) {
  const Rollout rollout(name);
  const Model& model = rollout.scene.model;
  Workspace workspace(model);
  Inverse inverse;
  size_t k = 0;
  for (auto _ : run) {
    step_inverse(model, rollout.scene.options, rollout.states[k].q, rollout.states[k].v,
                 rollout.states[k + 1].v, workspace, inverse);
    benchmark::DoNotOptimize(inverse.force_scale);
    if (++k == rollout.num_steps()) k = 0;
  }
  label(run, rollout);
}

/// What the algorithms read and write.
struct Vectors {
  explicit Vectors(int nv)
      : in(VectorX::Constant(nv, 0.1)),
        zero(VectorX::Zero(nv)),
        out(VectorX::Zero(nv)),
        M(nv, nv) {}
  VectorX in, zero, out;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M;
};

/// An algorithm on the start of a scene, kinematics computed before unless it is what is timed.
template <class Algorithm>
void algorithm(benchmark::State& run, const std::string& name, Algorithm compute) {
  const Scene scene =
      load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"));
  Data data(scene.model);
  compute_poses(scene.model, scene.q, data);
  compute_velocities(scene.model, scene.v, data);
  Vectors vectors(scene.model.nv());
  for (auto _ : run) {
    compute(scene, data, vectors);
    benchmark::ClobberMemory();
  }
  run.counters["nv"] = scene.model.nv();
}

void register_algorithms(const std::string& name) {
  const auto add = [&](const char* what, auto compute) {
    benchmark::RegisterBenchmark(
        fmt::format("{}/{}", what, name).c_str(),
        [name, compute](benchmark::State& run) { algorithm(run, name, compute); })
        ->Unit(benchmark::kMicrosecond);
  };
  add("kinematics", [](const Scene& scene, Data& data, Vectors&) {
    compute_poses(scene.model, scene.q, data);
    compute_velocities(scene.model, scene.v, data);
  });
  add("rnea",
      [](const Scene& scene, Data& data, Vectors& x) { rnea(scene.model, x.in, scene.model.gravity(), data, x.out); });
  add("aba", [](const Scene& scene, Data& data, Vectors& x) {
    aba(scene.model, x.in, x.zero, scene.model.gravity(), moving_bodies(scene.model), data, x.out);
  });
  add("crba", [](const Scene& scene, Data& data, Vectors& x) { crba(scene.model, data, x.M); });
}

void register_all() {
  for (const std::string name : kScenes) {
    benchmark::RegisterBenchmark(("forward_step/" + name).c_str(), [name](benchmark::State& run) {
      forward_step(run, name);
    })->Unit(benchmark::kMicrosecond);
    benchmark::RegisterBenchmark(("inverse_step/" + name).c_str(), [name](benchmark::State& run) {
      inverse_step(run, name);
    })->Unit(benchmark::kMicrosecond);
  }
  for (const std::string name : kTrees) register_algorithms(name);
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    counterpoint::apps::register_all();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    fmt::print(stderr, "failed: {}\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
  return 0;
}
