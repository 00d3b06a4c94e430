// counterpoint control: a robot driven by plans that are made anew many times a second.
#include "counterpoint/engine/optimize/control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "input/data_folder.h"
#include "measure/run_outputs.h"
#include "optimize/plan_trace.h"
#include "report/report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

namespace opt = optimization;

struct ControlArguments {
  std::string problem, world, output;
  std::optional<double> duration, interval, smoothing, penalty;
  std::optional<int> iterations, threads;
  std::vector<double> push;
  std::string pushed_link;
  opt::WorldErrors errors;
  double mass_factor = 1.0, friction_factor = 1.0;
  bool own_thread = false;
  std::uint64_t seed = 0;
  int runs = 1;
  view::ViewOption view;
  Report report;
};

void apply(const ControlArguments& arguments, opt::ControlFile& control) {
  if (!arguments.world.empty()) opt::use_world(control, arguments.world);
  const auto set = [](const auto& given, auto& value) {
    if (given) value = *given;
  };
  set(arguments.duration, control.duration);
  set(arguments.interval, control.interval);
  set(arguments.smoothing, control.planner.smoothing);
  set(arguments.penalty, control.planner.penalty);
  set(arguments.iterations, control.planner.iterations);
  set(arguments.threads, control.planner.threads);
  control.own_thread = arguments.own_thread;
  if (arguments.pushed_link.empty() && arguments.push.empty()) return;
  if (arguments.pushed_link.empty() || arguments.push.size() < 4 || arguments.push.size() > 5)
    throw InputError("--push FX FY FZ START [DURATION] (N, s) and --push-link go together");
  opt::Push push;
  push.link = opt::pushed_link(control.world->model, arguments.pushed_link);
  push.force = Vector3(arguments.push[0], arguments.push[1], arguments.push[2]);
  push.start = arguments.push[3];
  if (arguments.push.size() == 5) push.duration = arguments.push[4];
  control.pushes = {push};
}

/// Value below which a share of the sorted values lies.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void fill_run(const opt::ControlFile& control, const opt::ControlRun& run, std::uint64_t seed,
              Json& out) {
  const double simulated = run.end.time;
  const double planner = std::accumulate(run.replan_seconds.begin(), run.replan_seconds.end(), 0.0);
  out["seed"] = seed;
  out["status"] = run.fault.any() ? "failed" : run.stopped ? "stopped" : "ok";
  out["success"] = run.success();
  out["error_to_goal"] =
      run.error.empty() ? 0.0 : *std::max_element(run.error.begin(), run.error.end());
  out["simulated_s"] = simulated;
  out["realtime_factor"] =
      simulated / (control.own_thread ? run.wall_seconds : planner + run.world_seconds);
  out["planner_share"] = planner / simulated;
  out["replans"] = run.replan_seconds.size();
  out["replan_ms_median"] = 1e3 * quantile(run.replan_seconds, 0.5);
  out["replan_ms_p99"] = 1e3 * quantile(run.replan_seconds, 0.99);
  out["violation_mean"] = run.violation_mean;
  out["restarts"] = run.restarts;
  Json tests = Json::array();
  for (std::size_t i = 0; i < run.error.size(); ++i) {
    const opt::SuccessTest& test = control.success[i];
    tests.push_back({{"coordinate", test.name},
                     {"rate", test.rate},
                     {"passed", run.passed[i] != 0},
                     {"error", run.error[i]},
                     {"allowed", test.allowed()}});
  }
  out["tests"] = tests;
}

/// Runs once, writing the requested outputs on the way.
opt::ControlRun run_once(const ControlArguments& arguments, const opt::ControlFile& control,
                         const Scene& world, std::uint64_t seed) {
  RunOutputs outputs(arguments.output, arguments.view, world, opt::input_columns(control));
  PlanTrace plans(control.interval);
  opt::ControlHooks hooks;
  if (outputs.recorder)
    hooks.replanned = [&](const opt::Planner& planner, const opt::ReplanReport& plan,
                          double seconds) { plans.add(planner, plan, seconds); };
  hooks.keep_on = [](double) { return !Interrupt::wanted(); };
  if (outputs.any())
    hooks.step = [&](const State& before, const Input& input, double h, const State& after,
                     const StepReport& report) { outputs.step(before, input, h, after, report); };
  opt::ControlRun run = opt::run_control(control, world, seed, arguments.errors, hooks);
  if (outputs.writer) outputs.writer->write_end(run.end);
  if (outputs.recorder) {
    view::Replay replay = view::make_replay(
        world, {control.file.scene_file.string(), {arguments.problem, arguments.output}},
        outputs.recorder->finish(run.end), plans.ghosts());
    replay.curves = plans.curves(world.model, replay.clip);
    view::write_whole(arguments.view.file(), view::replay_page(replay));
  }
  return run;
}

void print_run(const Json& run, const Report& report) {
  report.print("{}: {}\n", run["success"].get<bool>() ? "succeeded" : "failed",
               format_entries("seed {seed}, {simulated_s:.6g} s; planner {planner_share:.3f} of "
                              "real time, a replan {replan_ms_median:.2f} ms (99 %: "
                              "{replan_ms_p99:.2f} ms); mean violation {violation_mean:.2g}, "
                              "{restarts} restarts",
                              run));
  for (const Json& test : run["tests"])
    report.print("  {}{}: error {:.4g}, allowed {:.4g}{}\n",
                 test["rate"].get<bool>() ? "rate of " : "", test["coordinate"].get<std::string>(),
                 test["error"].get<double>(), test["allowed"].get<double>(),
                 test["passed"].get<bool>() ? "" : " - not passed");
}

int control(ControlArguments& arguments) {
  arguments.view.check();
  if (arguments.runs > 1 && (arguments.view.wanted() || !arguments.output.empty()))
    throw InputError("--runs: --output and --view keep one run; give its --seed alone");
  opt::ControlFile control = opt::load_control(arguments.problem);
  apply(arguments, control);
  Scene world = opt::scaled_world(*control.world, arguments.mass_factor, arguments.friction_factor);
  world.options.time_step = control.plant_step;
  Report& report = arguments.report;
  report.begin("control", control.file.scene_file.string());
  report["problem"] = arguments.problem;
  const Interrupt interrupt;
  Json list = Json::array();
  int succeeded = 0;
  for (int i = 0; i < arguments.runs && !Interrupt::wanted(); ++i) {
    const std::uint64_t seed = arguments.seed + static_cast<std::uint64_t>(i);
    const opt::ControlRun run = run_once(arguments, control, world, seed);
    fill_run(control, run, seed, list.emplace_back());
    print_run(list.back(), report);
    succeeded += run.success();
  }
  if (!list.empty()) report.json().update(list[0]);
  report["succeeded_runs"] = succeeded;
  if (arguments.runs > 1) report["runs"] = list;
  report.write();
  if (Interrupt::wanted()) return end_stopped(" after {} of {} runs", list.size(), arguments.runs);
  return succeeded == arguments.runs ? kSuccess : kFailed;
}

std::string bundled_control(const std::string& name) {
  return bundled_file(name, {"scenes/control"});
}

}  // namespace

void add_control(CommandLine& line) {
  auto [command, arguments] = line.add<ControlArguments>(
      "control", "Drive a robot by plans that are made anew many times a second",
      "Example:\n  counterpoint control quadruped_walk --runs 6 --json walk.json", control);
  command.add("PROBLEM", arguments.problem,
              "Control problem (.yaml), or bundled name (list control)", becomes(bundled_control),
              required);
  command.add(
      "--world", arguments.world,
      "Scene (.yaml) that is simulated in place of the problem's, with the same coordinates");
  command.add("--duration", arguments.duration, "Simulated time [s]; default: the problem's",
              positive);
  command.add("--seed", arguments.seed,
              "Of the perturbed start and of noise; 0, the default: the plain start");
  command.add("--runs", arguments.runs, "So many runs, from seeds one apart", positive);
  command.add("--interval", arguments.interval, "Time between replans [s]", positive);
  command.add("--iterations", arguments.iterations, "Gauss-Newton steps of every replan", positive);
  command.add("--smoothing", arguments.smoothing, "Smoothing [m] of the plan's contacts", positive);
  command.add("--penalty", arguments.penalty, "Weight of forces where there is no motor", positive);
  command.add("--threads", arguments.threads,
              "Threads of the planner; 0: one per core; results are the same to the bit",
              not_negative);
  command.add(
      "--own-thread", arguments.own_thread,
      "Plan in another thread while the world goes on for --delay; same results to the bit");
  command.add("--delay", arguments.errors.delay,
              "Time from a measurement to the use of its plan [s]", not_negative);
  command.add("--position-noise", arguments.errors.position_noise,
              "Standard deviation of measured positions [rad, m]", not_negative);
  command.add("--velocity-noise", arguments.errors.velocity_noise,
              "Standard deviation of measured velocities [rad/s, m/s]", not_negative);
  command.add("--mass-factor", arguments.mass_factor,
              "The world's masses over those the planner knows", positive);
  command.add("--friction-factor", arguments.friction_factor,
              "The world's friction over that the planner knows", positive);
  command.add("--push FX,FY,FZ,START[,DURATION]", arguments.push,
              "Force [N] on a link for a time [s], default 0.1 s, in place of the problem's pushes",
              comma_separated);
  command.add("--push-link", arguments.pushed_link, "Link that is pushed, at its centre of mass");
  command.add("--output", arguments.output,
              "Table to write (.csv, .h5, .npz, .mcap): the motion and its forces");
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
