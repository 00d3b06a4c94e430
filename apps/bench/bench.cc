// Microseconds of a forward step, of an inverse step, and of each algorithm that they consist of.
// Usage: counterpoint_bench [--benchmark_filter=REGEX]; all benchmarks are registered in main.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenes[] = {"cube_drop",     "pendulum",  "arm7",    "quadruped_drop",
                                   "humanoid_drop", "box_stack", "stack_5", "pyramid_5",
                                   "grid_5",        "pack_4"};
constexpr const char* kTrees[] = {"arm7", "quadruped_drop", "humanoid_drop"};

/// A scene and its states over its duration, with impacts and rest: the states that steps are timed
/// on.
struct Rollout {
  /// Only these effects are on.
  explicit Rollout(const std::string& name, EffectSet effects = kDefaultEffects,
                   Integrator integrator = Integrator::kSemiImplicitEuler)
      : scene(load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"))) {
    scene.options.effects = effects;
    scene.options.integrator = integrator;
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

/// One iteration is one step, from the states of the rollout in turn.
void forward_step(benchmark::State& run, const std::string& name,
                  EffectSet effects = kDefaultEffects) {
  const Rollout rollout(name, effects);
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

/// Inverse step of implicit_midpoint, with the contact velocity solved for (`solved`) or taken from
/// the poses.
void inverse_midpoint(benchmark::State& run, const std::string& name, bool solved) {
  const Rollout rollout(name, kDefaultEffects, Integrator::kImplicitMidpoint);
  const Model& model = rollout.scene.model;
  Workspace workspace(model);
  Workspace::Impl& ws = workspace.impl();
  const SimulationOptions& options = rollout.scene.options;
  const EffectSet effects = active_effects(ws.called, options.effects);
  Inverse inverse;
  const Input known;
  size_t k = 0;
  for (auto _ : run) {
    const State &before = rollout.states[k], &after = rollout.states[k + 1];
    invert_step(
        {model, options, before.q, before.v, after.q, after.v, known, effects, before.z, !solved},
        ws, inverse);
    benchmark::DoNotOptimize(inverse.force_scale);
    if (++k == rollout.num_steps()) k = 0;
  }
  label(run, rollout);
}

/// Continues to step a scene after its first second, with or without sleeping.
void after_a_second(benchmark::State& run, const std::string& name, bool sleeping) {
  Scene scene = load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"));
  Simulator simulator(scene);
  while (simulator.state().time < 1.0) simulator.step();
  simulator.options().effects.set(Effect::kSleeping, sleeping);
  StepReport report;
  for (auto _ : run) report = simulator.step();
  run.counters["nv"] = scene.model.nv();
  run.counters["contacts"] = report.contacts;
  run.counters["asleep"] = report.sleeping_bodies;
}

/// Arguments and results of the algorithms.
struct Vectors {
  Vectors(int nq, int nv)
      : in(VectorX::Constant(nv, 0.1)),
        zero(VectorX::Zero(nv)),
        out(VectorX::Zero(nv)),
        q(VectorX::Zero(nq)),
        M(nv, nv) {}
  VectorX in, zero, out, q;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M;
};

/// Times an algorithm at the start of a scene; kinematics are computed before, unless they are
/// timed.
template <class Algorithm>
void algorithm(benchmark::State& run, const std::string& name, Algorithm compute) {
  const Scene scene =
      load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"));
  Data data(scene.model);
  compute_poses(scene.model, scene.q, data);
  compute_velocities(scene.model, scene.v, data);
  Vectors vectors(scene.model.nq(), scene.model.nv());
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
  add("rnea", [](const Scene& scene, Data& data, Vectors& x) {
    rnea(scene.model, x.in, scene.model.gravity(), data, x.out);
  });
  add("aba", [](const Scene& scene, Data& data, Vectors& x) {
    aba(scene.model, x.in, x.zero, scene.model.gravity(), moving_bodies(scene.model), data, x.out);
  });
  // The least work of a step without contacts, limits and friction, to compare with
  // forward_step/arm7_bare.
  add("aba_and_integration", [](const Scene& scene, Data& data, Vectors& x) {
    const Model& model = scene.model;
    compute_poses(model, scene.q, data);
    compute_velocities(model, scene.v, data);
    compute_inertias(model, data);
    aba(model, x.in, x.zero, model.gravity(), moving_bodies(model), data, x.out);
    x.in = scene.v + scene.options.time_step * x.out;
    integrate_configuration(model, scene.q, x.in, scene.options.time_step, x.q);
  });
  add("crba", [](const Scene& scene, Data& data, Vectors& x) { crba(scene.model, data, x.M); });
}

/// Wall time of 16 rollouts of 100 steps from the scene's start, on `threads` threads.
void batch_rollouts(benchmark::State& run, const std::string& name, int threads) {
  constexpr int kRollouts = 16, kSteps = 100;
  const Scene scene =
      load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"));
  Batch batch(scene, threads);
  for (auto _ : run) {
    batch.run(kRollouts, [](int, Simulator& simulator) {
      simulator.reset();
      for (int k = 0; k < kSteps; ++k) simulator.step();
    });
  }
  run.counters["steps/s"] = benchmark::Counter(
      static_cast<double>(run.iterations()) * kRollouts * kSteps, benchmark::Counter::kIsRate);
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
  for (const std::string name : {"cube_drop", "quadruped_drop", "humanoid_drop", "stack_5"}) {
    for (const bool solved : {true, false}) {
      benchmark::RegisterBenchmark(
          fmt::format("inverse_midpoint/{}/{}", name, solved ? "solved" : "read off poses").c_str(),
          [name, solved](benchmark::State& run) { inverse_midpoint(run, name, solved); })
          ->Unit(benchmark::kMicrosecond);
    }
  }
  // 1000 cubes at rest, one in flight.
  for (const bool sleeping : {true, false}) {
    benchmark::RegisterBenchmark(
        sleeping ? "asleep/columns_10" : "awake/columns_10",
        [sleeping](benchmark::State& run) { after_a_second(run, "columns_10", sleeping); })
        ->Unit(benchmark::kMicrosecond)
        ->Iterations(sleeping ? 500 : 50);
  }
  benchmark::RegisterBenchmark("forward_step/arm7_bare", [](benchmark::State& run) {
    forward_step(run, "arm7", {Effect::kGravity, Effect::kCoriolis});
  })->Unit(benchmark::kMicrosecond);
  for (const std::string name : kTrees) register_algorithms(name);
  for (const std::string name : {"humanoid_drop", "quadruped_drop"}) {
    for (const int threads : {1, 2}) {
      benchmark::RegisterBenchmark(
          fmt::format("batch_rollouts/{}/threads:{}", name, threads).c_str(),
          [name, threads](benchmark::State& run) { batch_rollouts(run, name, threads); })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
    }
  }
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
