// counterpoint simulate: a scene and applied forces in, a trajectory out.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "command.h"
#include "counterpoint/engine/forces/effort_limits.h"
#include "counterpoint/engine/io/state_file.h"
#include "counterpoint/engine/io/trajectory.h"
#include "counterpoint/engine/simulator.h"
#include "input/applied_inputs.h"
#include "input/scene_arguments.h"
#include "interrupt.h"
#include "measure/run_watch.h"
#include "measure/step_statistics.h"
#include "measure/thread_clock.h"
#include "measure/total_energy.h"
#include "report/contact_table.h"
#include "report/failure.h"
#include "report/progress.h"
#include "report/report.h"
#include "report/step_control_report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct Arguments {
  SceneArguments scene;
  std::optional<double> duration, time_step;
  std::string adaptive;  ///< tolerance, "off", or empty: as the scene says
  std::optional<double> event_tolerance, wall_limit;
  std::string output, contacts, save_state, resume;
  bool changed_scene = false, strict = false;
  InputArguments inputs;
  view::ViewOption view;
  Report report;
};

/// What is counted over the steps of a run.
struct Tally {
  ControlTally control;
  StepStatistics statistics;
  long softened_steps = 0;
  double softening_max = 1.0, softened_first = 0.0;
  long steps = 0, contacts = 0, sleeping = 0, newton_iterations = 0, newton_iterations_max = 0,
       failures = 0;
  double max_penetration = 0.0, end_penetration = 0.0, wall_seconds = 0.0;
  double wall_limit = std::numeric_limits<double>::infinity();
  std::unique_ptr<RunWatch> watch;  ///< only where a report is wanted: it costs some time a step

  bool interrupted = false;  ///< by Ctrl-C

  /// The run is to end here.
  bool stops() {
    interrupted = Interrupt::wanted();
    return interrupted || wall_seconds > wall_limit;
  }
  /// `seconds`: processor time of the step.
  void add(const StepReport& step, double start_time, double seconds) {
    if (step.softening.any()) {
      if (softened_steps++ == 0) softened_first = start_time;
      softening_max = std::max(softening_max, std::abs(step.softening.factor));
    }
    statistics.add(step.newton_iterations, seconds);
    ++steps;
    contacts += step.contacts;
    sleeping += step.sleeping_bodies;
    newton_iterations += step.newton_iterations;
    newton_iterations_max = std::max<long>(newton_iterations_max, step.newton_iterations);
    end_penetration = step.max_penetration;
    max_penetration = std::max(max_penetration, step.max_penetration);
  }
};

void apply_overrides(const Arguments& arguments, SimulationOptions& options) {
  override_step_control(arguments.adaptive, arguments.event_tolerance, options);
  override_times(arguments.duration, arguments.time_step, options);
}

/// Where the steps go, each only if asked for.
struct Outputs {
  std::unique_ptr<TrajectoryWriter> writer;
  std::unique_ptr<view::ClipRecorder> recorder;
  std::unique_ptr<ContactTable> contacts;
  bool any() const { return writer || recorder; }

  void step(const State& before, const Input& input, double h, const State& after,
            const StepReport& report) {
    if (writer) writer->write_step(before, input, h, report.softening);
    if (!recorder) return;
    Input known = input;
    known.softening = report.softening;
    recorder->add_step(before, known, h, after, report.newton_iterations);
  }
};

/// Steps the simulator to the end, or to the first step that fails. The trajectory ends with the
/// last good state.
std::optional<FailedStep> run(Simulator& simulator, AppliedInputs& inputs, Outputs& outputs,
                              Tally& tally) {
  const double h = simulator.options().time_step;
  const long steps = std::lround(std::ceil(simulator.options().duration / h - 1e-6));
  std::optional<FailedStep> failed;
  State before;
  Progress progress("simulating", static_cast<int>(steps));
  for (long k = 0; k < steps && !failed && !tally.stops(); ++k) {
    inputs.set(simulator);
    if (outputs.any()) before = simulator.state();
    const double start_time = simulator.state().time;
    const auto start = std::chrono::steady_clock::now();
    const double busy = thread_seconds();
    const StepReport step = simulator.step();
    const double seconds = thread_seconds() - busy;
    tally.wall_seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    tally.add(step, start_time, seconds);
    if (!step.succeeded()) {
      ++tally.failures;
      failed = {k, simulator.state().time, step};
    } else {
      if (outputs.any()) outputs.step(before, simulator.input(), h, simulator.state(), step);
      if (outputs.contacts) outputs.contacts->add_step(start_time, simulator.last_forces());
      if (tally.watch) tally.watch->after_step(h, simulator.state());
    }
    progress.update(static_cast<int>(k + 1));
  }
  if (outputs.writer) outputs.writer->write_end(simulator.state());
  return failed;
}

/// The same in controlled steps; every half is a step, and a row of the trajectory.
std::optional<FailedStep> run_controlled(Simulator& simulator, AppliedInputs& inputs,
                                         Outputs& outputs, Tally& tally) {
  const SimulationOptions& options = simulator.options();
  const double start_time = simulator.state().time, end = start_time + options.duration;
  std::optional<FailedStep> failed;
  State before;
  constexpr int kParts = 1000;
  Progress progress("simulating", kParts);
  while (simulator.state().time < end && !failed && !tally.stops()) {
    inputs.set(simulator);
    before = simulator.state();
    const double landing = std::min(next_landing(*options.step_control, before.time, end),
                                    inputs.next_change(before.time));
    const auto start = std::chrono::steady_clock::now();
    const double busy = thread_seconds();
    const ControlledReport step = simulator.step_controlled(landing);
    const double seconds = thread_seconds() - busy;
    tally.wall_seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    tally.add(step.first, before.time, 0.5 * seconds);
    tally.add(step.second, before.time + 0.5 * step.step, 0.5 * seconds);
    tally.control.add(step);
    if (!step.succeeded()) {
      ++tally.failures;
      failed = {tally.steps - 1, before.time, step.second};
    } else {
      outputs.step(before, simulator.input(), 0.5 * step.step, simulator.middle(), step.first);
      outputs.step(simulator.middle(), simulator.input(), 0.5 * step.step, simulator.state(),
                   step.second);
      if (outputs.contacts)
        outputs.contacts->add_step(simulator.middle().time, simulator.last_forces());
      if (tally.watch) {
        tally.watch->after_step(0.5 * step.step, simulator.middle());
        tally.watch->after_step(0.5 * step.step, simulator.state());
      }
    }
    progress.update(static_cast<int>(kParts * (simulator.state().time - start_time) /
                                     std::max(options.duration, before.time - start_time)));
  }
  if (outputs.writer) outputs.writer->write_end(simulator.state());
  return failed;
}

void fill_report(const Tally& tally, double simulated_seconds, Report& report) {
  const double steps = static_cast<double>(std::max(tally.steps, 1L));
  report["steps"] = tally.steps;
  report["simulated_seconds"] = simulated_seconds;
  report["wall_seconds"] = tally.wall_seconds;
  report["realtime_factor"] =
      tally.wall_seconds > 0.0 ? simulated_seconds / tally.wall_seconds : 0.0;
  report["contacts_mean"] = tally.contacts / steps;
  report["sleeping_bodies_mean"] = tally.sleeping / steps;
  report["newton_iterations_mean"] = tally.newton_iterations / steps;
  report["newton_iterations_max"] = tally.newton_iterations_max;
  tally.statistics.fill(report.json());
  report["solver_failures"] = tally.failures;
  report["softened_steps"] = tally.softened_steps;
  report["softening_max"] = tally.softening_max;
  if (tally.softened_steps > 0) report["softened_first_time_s"] = tally.softened_first;
  report["max_penetration_m"] = tally.max_penetration;
  report["end_penetration_m"] = tally.end_penetration;
  if (tally.watch) tally.watch->fill(report.json());
}

/// Why the run ended before its time without a step that failed; empty: it did not.
std::string stopped(const Tally& tally, const Simulator& simulator) {
  if (tally.interrupted)
    return fmt::format("stopped at {:.6g} s by Ctrl-C or SIGTERM", simulator.state().time);
  if (!(tally.wall_seconds > tally.wall_limit)) return {};
  return fmt::format("stopped at {:.6g} s after {:g} s of wall time, as --wall-limit asks",
                     simulator.state().time, tally.wall_limit);
}

void write_report(Arguments& arguments, const Simulator& simulator, const State& start,
                  const std::optional<FailedStep>& failed, const std::string& message,
                  const Tally& tally) {
  const Model& model = simulator.model();
  const auto& control = simulator.options().step_control;
  Report& report = arguments.report;
  report.begin("simulate", arguments.scene.file);
  report["status"] = failed ? "failed" : message.empty() ? "ok" : "stopped";
  if (!message.empty()) report["message"] = message;
  if (failed) add_failure(model, *failed, report.json());
  report["time_step_s"] = simulator.options().time_step;
  fill_report(tally, simulator.state().time - start.time, report);
  if (control) report["step_control"] = step_control_report(*control, tally.control, simulator);
  report["energy_start_J"] = total_energy(model, start);
  report["energy_end_J"] = total_energy(model, simulator.state());
  report["start_time_s"] = start.time;
  report["state_hash"] = std::to_string(state_hash(simulator.state()));
  report.write();
}

void print_figures(const Report& report, const Simulator& simulator, double simulated,
                   const Tally& tally) {
  const double steps = static_cast<double>(std::max(tally.steps, 1L));
  fmt::print(
      report.text(),
      "{} steps, {:.6g} s simulated in {:.3g} s; {:.3g} contacts and {:.3g} Newton iterations a "
      "step, deepest penetration {:.3g} m; state hash {}\n",
      tally.steps, simulated, tally.wall_seconds, tally.contacts / steps,
      tally.newton_iterations / steps, tally.max_penetration, state_hash(simulator.state()));
  if (tally.softened_steps > 0)
    fmt::print(
        report.text(),
        "{} steps were solved with softer contacts, at most {:.3g} times, the first at {:.6g} "
        "s\n",
        tally.softened_steps, tally.softening_max, tally.softened_first);
  if (simulator.options().step_control)
    fmt::print(report.text(), "{}\n", step_control_text(tally.control));
}

/// From the start of a motion, by its steps, as long as it takes.
void follow(const Arguments& arguments, const Follower& motion, Simulator& simulator) {
  if (simulator.options().step_control || arguments.time_step)
    throw InputError("--follow steps as the motion does: leave --adaptive and --timestep out");
  simulator.options().time_step = motion.time_step();
  if (!arguments.duration) simulator.options().duration = motion.duration();
  if (arguments.resume.empty())
    simulator.set_state(motion.start(simulator.model(), arguments.inputs.seed));
}

int simulate(Arguments& arguments) {
  arguments.view.check();
  Scene scene = arguments.scene.load();
  apply_overrides(arguments, scene.options);
  for (const Note& note : scene.model.notes()) {
    fmt::print(stderr, "note: {}: {}\n", note.where, note.message);
  }
  Simulator simulator(std::move(scene));
  const Model& model = simulator.model();
  if (!arguments.resume.empty()) {
    simulator.set_state(read_state(arguments.resume, model, simulator.options(),
                                   arguments.changed_scene ? SceneCheck::kAny : SceneCheck::kSame));
    if (const auto step = read_next_step(arguments.resume)) simulator.set_next_step(*step);
  }
  if (arguments.strict) simulator.settings().soften_after = 0;
  AppliedInputs inputs(arguments.inputs, simulator);
  if (inputs.follower() != nullptr) follow(arguments, *inputs.follower(), simulator);
  Outputs outputs;
  if (!arguments.output.empty())
    outputs.writer =
        std::make_unique<TrajectoryWriter>(arguments.output, model, inputs.columns(model));
  if (arguments.view.wanted())
    outputs.recorder =
        std::make_unique<view::ClipRecorder>(simulator.scene(), arguments.view.rate(), true);
  if (!arguments.contacts.empty() && simulator.options().integrator == Integrator::kRungeKutta4)
    throw InputError(
        "--contacts: forces are read off the motion, and runge_kutta_4 has no inverse");
  if (!arguments.contacts.empty())
    outputs.contacts = std::make_unique<ContactTable>(arguments.contacts, model);
  const State start = simulator.state();
  const Interrupt interrupt;
  Tally tally;
  tally.wall_limit = arguments.wall_limit.value_or(tally.wall_limit);
  if (arguments.report.wanted()) tally.watch = std::make_unique<RunWatch>(simulator);
  const auto& control = simulator.options().step_control;
  const std::optional<FailedStep> failed =
      (control ? run_controlled : run)(simulator, inputs, outputs, tally);
  if (!arguments.save_state.empty()) {
    write_state(arguments.save_state, model, simulator.options(), simulator.state(),
                control ? std::optional(simulator.next_step()) : std::nullopt);
  }
  if (outputs.recorder)
    view::write_replay(arguments.view.file(), simulator.scene(),
                       {arguments.scene.file,
                        {arguments.inputs.file, arguments.resume},
                        arguments.scene.package_folders()},
                       outputs.recorder->finish(simulator.state()));

  if (inputs.follower() != nullptr)
    arguments.report["follow_error_max"] = inputs.follower()->error_max();
  const std::string message = failed ? failure_message(model, *failed) : stopped(tally, simulator);
  write_report(arguments, simulator, start, failed, message, tally);
  if (message.empty()) {
    print_figures(arguments.report, simulator, simulator.state().time - start.time, tally);
    return kSuccess;
  }
  fmt::print(stderr, "error: {}\n", message);
  if (!arguments.output.empty())
    fmt::print(stderr, "{} goes up to the last good state, at {:.6g} s\n", arguments.output,
               simulator.state().time);
  return kFailed;
}

}  // namespace

void add_simulate(CommandLine& line) {
  auto arguments = std::make_shared<Arguments>();
  Command& command = line.add("simulate", "Simulate a scene; write its trajectory");
  arguments->scene.add_to(command);
  add_times(command, arguments->duration, arguments->time_step);
  command
      .add_option(
          "--adaptive", arguments->adaptive,
          "Steps as long as the error allows: TOL is what a simulated second may add to any "
          "coordinate [m/s, rad/s]; or off. Default: the scene's step_control")
      .type_name("TOL|off");
  command
      .add_option("--event-tolerance", arguments->event_tolerance,
                  "With step control: impacts fall into steps of at most this [s]; default: the "
                  "scene's, or 1e-6")
      .seldom();
  command.add_option(
      "--inputs", arguments->inputs.file,
      "CSV of what acts: time, '<joint>.u', '<joint>.target', '<link>.fx' ...; a row holds "
      "until the next (docs/reference/trajectory-format.md)");
  add_follow(command, arguments->inputs.follow);
  add_random_inputs(command, arguments->inputs);
  command.add_flag("--strict", arguments->strict,
                   "End at a step that cannot be solved; else it is solved with softer contacts, "
                   "counted and recorded");
  command.add_option("--output", arguments->output,
                     "Trajectory to write (docs/reference/trajectory-format.md)");
  command.add_option("--contacts", arguments->contacts,
                     "CSV to write: the contacts of every step and their forces, as `inverse "
                     "--contacts` does; of a controlled step those of its second half");
  command
      .add_option("--save-state", arguments->save_state,
                  "Write the last state, to go on from to the same bits")
      .type_name("FILE");
  Option& resume =
      command
          .add_option("--resume", arguments->resume,
                      "Start from a state saved by --save-state, of the same scene; the "
                      "duration counts from there")
          .type_name("FILE");
  command
      .add_flag("--changed-scene", arguments->changed_scene,
                "With --resume: the scene may have changed, and FILE may be a trajectory (its last "
                "row)")
      .needs(resume)
      .seldom();
  command
      .add_option("--wall-limit", arguments->wall_limit,
                  "Stop (exit code 1) once the steps have taken this long [s]; default: never")
      .positive();
  arguments->view.add_to(command);
  arguments->report.add_to(command);
  command.footer(
      "Example:\n  counterpoint simulate data/scenes/arm7.yaml --duration 1 "
      "--random-inputs 0.5 --output arm.csv --json arm.json");
  command.action([arguments] { return simulate(*arguments); });
}

}  // namespace counterpoint::apps
