// Trajectory optimization: milliseconds of a full Newton step (derivatives, assembly,
// factorization, trials) by problem, frames and threads, of its parts, and of a whole half gait;
// inverse evaluations per second. Usage: counterpoint_bench_optimize [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;
namespace opt = optimization;

const fs::path kProblems = fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes/optimize";
/// Smoothing in the middle of a continuation [m]: contacts act and are smooth.
constexpr double kMiddle = 1e-2;

/// A problem after a few iterations, so that its contacts carry loads as in a run.
struct Prepared {
  opt::ProblemFile file;
  std::unique_ptr<opt::Newton> newton;
  opt::Variables frames;
  double damping = 0.0;

  Prepared(const fs::path& problem, std::optional<int> steps, int threads)
      : file(opt::load_problem(problem, steps)),
        newton(std::make_unique<opt::Newton>(file.problem, file.guess, threads)) {
    newton->begin(opt::stage_at(file.problem, file.settings, kMiddle));
    for (int i = 0; i < 5; ++i) newton->iterate();
    frames = newton->frames().variables();
    damping = newton->damping();
  }
};

/// Repeats one Newton step from the same frames, with the damping that a run has there. Writes the
/// time of its parts into the counters and returns their sum [ms].
double repeat_step(benchmark::State& state, opt::Newton& newton, const opt::Variables& variables,
                   double damping, const opt::Stage& stage) {
  double linearize = 0.0, factor = 0.0, trial = 0.0;
  int trials = 0;
  for (auto _ : state) {
    state.PauseTiming();
    newton.frames().set_variables(variables);
    newton.begin(stage);
    newton.set_damping(damping);
    state.ResumeTiming();
    const opt::Iteration step = newton.iterate();
    linearize += 1e3 * step.linearize_seconds;
    factor += 1e3 * step.factor_seconds;
    trial += 1e3 * step.trial_seconds;
    trials += step.trials;
  }
  const auto mean = [](double sum) {
    return benchmark::Counter(sum, benchmark::Counter::kAvgIterations);
  };
  state.counters["linearize_ms"] = mean(linearize);
  state.counters["factor_ms"] = mean(factor);
  state.counters["trial_ms"] = mean(trial);
  state.counters["trials"] = mean(trials);
  return linearize + factor + trial;
}

/// Times a Newton step of a problem in the middle of its continuation.
void newton_step(benchmark::State& state, const fs::path& problem, std::optional<int> steps,
                 int threads) {
  Prepared prepared(problem, steps, threads);
  const opt::Stage stage = opt::stage_at(prepared.file.problem, prepared.file.settings, kMiddle);
  const double parts =
      repeat_step(state, *prepared.newton, prepared.frames, prepared.damping, stage);
  state.counters["ms_per_frame"] =
      benchmark::Counter(parts / prepared.file.problem.steps, benchmark::Counter::kAvgIterations);
}

/// Times an optimization from the initial guess to a smoothing of 1e-6 m.
void whole_run(benchmark::State& state, const char* problem, int threads) {
  const opt::ProblemFile file = opt::load_problem(kProblems / problem);
  opt::Settings settings = file.settings;
  settings.threads = threads;
  settings.continuation.end = 1e-6;
  opt::Result result;
  for (auto _ : state) result = opt::optimize(file.problem, file.guess, settings);
  state.counters["newton_steps"] = result.iterations;
  state.counters["unactuated"] = result.unactuated.max;
  state.SetLabel(opt::outcome_name(result.outcome));
}

/// Times step_inverse along the frames of the humanoid's gait in the middle of its continuation.
void inverse_evaluations(benchmark::State& state, int threads) {
  const Prepared prepared(kProblems / "humanoid_walk.yaml", {}, 1);
  const opt::Problem& problem = prepared.file.problem;
  const Model& model = *problem.model;
  const SimulationOptions options = opt::stage_at(problem, prepared.file.settings, kMiddle).options;
  const std::vector<VectorX> q = prepared.newton->frames().all();
  std::vector<VectorX> v;
  for (std::size_t t = 0; t + 1 < q.size(); ++t) {
    v.emplace_back(model.nv());
    configuration_difference(model, q[t], q[t + 1], v.back());
    v.back() /= problem.h();
  }
  contact::ThreadPool pool(threads);
  std::vector<Workspace> workspaces;
  std::vector<Inverse> inverses(static_cast<std::size_t>(threads));
  for (int i = 0; i < threads; ++i) workspaces.emplace_back(model);
  constexpr int kRepeats = 64;
  for (auto _ : state)
    pool.run(threads * kRepeats, [&](int, int thread) {
      const auto i = static_cast<std::size_t>(thread);
      for (std::size_t t = 1; t < v.size(); ++t)
        step_inverse(model, options, q[t], v[t - 1], v[t], workspaces[i], inverses[i]);
    });
  const double count = static_cast<double>(threads * kRepeats) * static_cast<double>(v.size() - 1);
  state.counters["inverses_per_second"] =
      benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate);
}

/// An open chain of `links` revolute joints with motors.
Model chain(int links) {
  RobotSpec robot;
  robot.name = "chain";
  for (int i = 0; i <= links; ++i) {
    LinkSpec link;
    link.name = fmt::format("link{}", i);
    link.inertia.mass = 1.0;
    link.inertia.center = Vector3(0.0, 0.0, -0.05);
    link.inertia.rotational = Vector3(1e-3, 1e-3, 1e-4).asDiagonal();
    robot.links.push_back(link);
    if (i == 0) continue;
    JointSpec joint;
    joint.name = fmt::format("joint{}", i);
    joint.parent = robot.links[static_cast<std::size_t>(i - 1)].name;
    joint.child = link.name;
    joint.axis = i % 2 == 0 ? Vector3::UnitX() : Vector3::UnitY();
    joint.X_PJ.translation = Vector3(0.0, 0.0, i == 1 ? 0.0 : -0.1);
    robot.joints.push_back(joint);
  }
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  return builder.build();
}

/// Times a Newton step of a chain over 40 frames; its terms depend on its coordinates only.
void chain_step(benchmark::State& state) {
  const Model model = chain(static_cast<int>(state.range(0)));
  opt::Problem problem;
  problem.model = &model;
  problem.options.time_step = 0.02;
  problem.options.mean_velocity_forces = false;
  problem.steps = 40;
  problem.motors = opt::motors_of(model);
  problem.start_q = problem.start_v = problem.goal_v = VectorX::Zero(model.nv());
  problem.goal_q = VectorX::Constant(model.nv(), 0.2);
  opt::Term effort;
  effort.quantity = opt::Quantity::kAppliedForce;
  effort.weight = VectorX::Ones(model.nv());
  problem.terms = {effort, opt::unactuated_condition(model, problem.motors)};
  const std::vector<VectorX> start =
      opt::straight_line(model, problem.start_q, *problem.goal_q, problem.steps);
  opt::Newton newton(problem, start, 1);
  opt::Stage stage;
  stage.options = problem.options;
  repeat_step(state, newton, newton.frames().variables(), 1e-3, stage);
}

void add_newton_step(const std::string& name, const fs::path& problem, std::optional<int> steps,
                     int threads) {
  benchmark::RegisterBenchmark(
      fmt::format("newton_step/{}/frames:{}/threads:{}", name, steps ? *steps : 0, threads).c_str(),
      [=](benchmark::State& state) { newton_step(state, problem, steps, threads); })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

void register_all() {
  const fs::path humanoid = kProblems / "humanoid_walk.yaml";
  for (const int threads : {1, 2}) {
    add_newton_step("humanoid", humanoid, 16, threads);
    add_newton_step("humanoid", humanoid, 60, threads);
  }
  for (const int frames : {30, 120, 250, 500, 1000})
    add_newton_step("humanoid", humanoid, frames, 1);
  add_newton_step("quadruped", kProblems / "quadruped.yaml", 20, 1);
  // Same numbers of steps as in IDTO's examples of the same kind.
  for (const auto& [name, steps] :
       {std::pair("acrobot", 40), std::pair("spinner", 40), std::pair("hopper", 40),
        std::pair("push_box", 40), std::pair("roll_ball", 10), std::pair("sizes/two_arms", 20),
        std::pair("sizes/hand", 40)})
    add_newton_step(name, kProblems / (std::string(name) + ".yaml"), steps, 2);
  benchmark::RegisterBenchmark("chain_step/links", chain_step)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->RangeMultiplier(2)
      ->Range(4, 64);
  for (const int threads : {1, 2}) {
    benchmark::RegisterBenchmark(
        fmt::format("half_gait_to_1e-6/threads:{}", threads).c_str(),
        [=](benchmark::State& state) { whole_run(state, "humanoid_walk.yaml", threads); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
    benchmark::RegisterBenchmark(
        fmt::format("inverse/humanoid/threads:{}", threads).c_str(),
        [=](benchmark::State& state) { inverse_evaluations(state, threads); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  counterpoint::apps::register_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
