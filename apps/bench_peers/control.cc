// MuJoCo MPC's planners on our control problems, in MuJoCo's world.
// Example: counterpoint_bench_control data/scenes/control/quadruped_stand.yaml --planner ilqg
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <vector>

#include "peers/mpc/mujoco_planner.h"
#include "peers/mujoco.h"

namespace counterpoint::apps {
namespace {

namespace opt = optimization;

constexpr int kFirstPlans = 50;  ///< made before the run begins

struct Run {
  bool success = false;
  double end = 0.0;                    ///< time of the last step [s]
  std::vector<double> values, replan;  ///< results of the success tests; processor times [s]
};

/// Judges like run_control: the worst value, the mean rate, or the value at the end.
struct Judged {
  double worst = 0.0, from_time = -1.0, from_value = 0.0;

  void see(const opt::SuccessTest& test, const State& state) {
    const double value = state.q[test.q_index];
    if (test.always && state.time >= test.from) worst = std::max(worst, test.error(value));
    if (from_time < 0.0 && state.time >= test.from - 1e-6)
      from_time = state.time, from_value = value;
  }
  double result(const opt::SuccessTest& test, const State& end) const {
    const double value = end.q[test.q_index];
    return test.rate ? (value - from_value) / (end.time - from_time) : value;
  }
};

void push(const opt::ControlFile& control, const Model& model, double time, Input& input) {
  input.wrenches.clear();
  for (const opt::Push& p : control.pushes) {
    if (time < p.start - 1e-6 || time >= p.start + p.duration - 1e-6) continue;
    const int body = model.frames()[static_cast<std::size_t>(p.link)].body;
    input.wrenches.push_back({body, {Vector3::Zero(), p.force}, model.body(body).inertia.center});
  }
}

Run run(const opt::ControlFile& control, const peers::MujocoPlannerTask& task, std::uint64_t seed) {
  Scene scene = *control.world;
  scene.options.time_step = control.plant_step;
  peers::Mujoco world(scene, peers::MujocoSettings::kElliptic);
  opt::ControlHooks only_start;
  only_start.keep_on = [](double) { return false; };
  world.set_state(opt::run_control(control, *control.world, seed, {}, only_start).end);
  peers::MujocoPlanner planner(task);
  for (int i = 0; i < kFirstPlans; ++i) planner.replan(*world.own_data());
  Input input;
  Run out;
  std::vector<Judged> judged(control.success.size());
  const long steps = std::lround(control.duration / control.plant_step);
  const long between = std::lround(control.interval / control.plant_step);
  bool stands = true;
  for (long i = 0; i <= steps && stands; ++i) {
    for (std::size_t k = 0; k < judged.size(); ++k) {
      judged[k].see(control.success[k], world.state());
      stands = stands && judged[k].worst == 0.0;
    }
    if (i == steps) break;
    if (i % between == 0) out.replan.push_back(planner.replan(*world.own_data()));
    planner.force(*world.own_data(), input.applied_force);
    push(control, scene.model, world.state().time, input);
    stands = stands && world.step(input).failure.empty();
  }
  out.end = world.state().time;
  out.success = stands;
  for (std::size_t k = 0; k < judged.size(); ++k) {
    const opt::SuccessTest& test = control.success[k];
    out.values.push_back(judged[k].result(test, world.state()));
    out.success = out.success && test.error(out.values.back()) <= test.allowed();
  }
  return out;
}

void report(const std::vector<Run>& runs) {
  std::vector<double> all;
  double seconds = 0.0, simulated = 0.0;
  int successes = 0;
  for (const Run& one : runs) {
    all.insert(all.end(), one.replan.begin(), one.replan.end());
    for (const double s : one.replan) seconds += s;
    simulated += one.end;
    successes += one.success;
  }
  std::sort(all.begin(), all.end());
  const auto rank = [&](double share) {
    return 1e3 * all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))];
  };
  fmt::print("succeeds {}/{}, share {:.3f}, replan {:.2f} ms, 99 % {:.2f} ms\n", successes,
             runs.size(), seconds / simulated, rank(0.5), rank(0.99));
}

int main_with(CLI::App& app, int argc, char** argv) {
  std::string problem;
  peers::MujocoPlannerTask task;
  std::vector<double> weights;
  int runs = 6;
  double duration = 0.0;
  app.add_option("problem", problem, "Control problem (.yaml)")->required();
  app.add_option("--planner", task.planner, "sampling, cross_entropy, ilqg or gradient");
  app.add_option("--runs", runs, "Runs, from seeds 0, 1 ...");
  app.add_option("--duration", duration, "Simulated time [s]; default: the problem's");
  app.add_option("--step", task.step, "Time step of the plan [s]");
  app.add_option("--horizon", task.horizon, "Length of the plan [s]");
  app.add_option("--candidates", task.candidates, "Rollouts a replan (of iLQG: per line search)");
  app.add_option("--points", task.spline_points, "Points of a spline of controls");
  app.add_option("--exploration", task.exploration, "Deviation of controls over half their range");
  app.add_option("--servo", task.servo, "Stiffness of servos over the problem's; 0: forces");
  app.add_option("--speed", task.target_speed, "Of the base [m/s]");
  app.add_option("--cadence", task.cadence, "Strides of the trot [1/s]");
  app.add_option("--lift", task.lift, "Height of its steps [m]");
  app.add_flag("--robust", task.robust, "Norms of MuJoCo MPC's quadruped, not squares");
  app.add_option("--weights", weights, "Of the eight residuals (mujoco_planner.h)")
      ->expected(static_cast<int>(peers::kPlannerResiduals))
      ->required();
  CLI11_PARSE(app, argc, argv);
  std::copy(weights.begin(), weights.end(), task.weights.begin());
  opt::ControlFile control = opt::load_control(problem);
  if (duration > 0.0) control.duration = duration;
  task.control = &control;
  task.posture = opt::control_start(control, *control.world);
  std::vector<Run> done;
  for (int seed = 0; seed < runs; ++seed) {
    done.push_back(run(control, task, static_cast<std::uint64_t>(seed)));
    fmt::print("seed {}: {} {:.2f} s, {:.3f}\n", seed, done.back().success ? "succeeds" : "fails",
               done.back().end, fmt::join(done.back().values, " "));
  }
  report(done);
  return 0;
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  CLI::App app("MuJoCo MPC's planners on our control problems");
  return counterpoint::apps::main_with(app, argc, argv);
}
