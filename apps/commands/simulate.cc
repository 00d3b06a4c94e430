// counterpoint simulate: computes a trajectory from a scene and applied forces.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "input/applied_inputs.h"
#include "input/scene_arguments.h"
#include "live/viewer.h"
#include "measure/run.h"
#include "measure/run_outputs.h"
#include "report/contact_table.h"
#include "report/failure.h"
#include "report/progress.h"
#include "report/report.h"
#include "report/step_control_report.h"
#include "report/total_energy.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct SimulateArguments {
  SceneArguments scene;
  std::optional<double> duration, time_step;
  std::string adaptive;  ///< tolerance, "off", or empty: keep the scene's setting
  std::optional<double> event_tolerance, wall_limit;
  std::string output, contacts, sensors, save_state, resume;
  bool changed_scene = false, strict = false, live = false;
  std::optional<int> step_budget;
  int threads = 1;
  InputArguments inputs;
  view::ViewOption view;
  Report report;
};

/// Destinations of the steps and of their contacts.
struct Outputs {
  RunOutputs steps;
  std::unique_ptr<ContactTable> contacts;  ///< if requested
  std::unique_ptr<live::Viewer> viewer;    ///< if requested
};

std::optional<FailedStep> run(Simulator& simulator, AppliedInputs& inputs, Outputs& outputs,
                              RunTally& tally) {
  constexpr int kParts = 1000;
  Progress progress("simulating", kParts);
  RunHooks hooks;
  hooks.stop = Interrupt::wanted;
  hooks.progress = [&](double share) { progress.update(std::lround(kParts * share)); };
  if (outputs.steps.any())
    hooks.step = [&](const State& before, const Input& input, double h, const State& after,
                     const StepReport& report) {
      outputs.steps.step(before, input, h, after, report);
    };
  if (outputs.contacts || outputs.viewer)
    hooks.forces = [&](double time) {
      if (outputs.contacts) outputs.contacts->add_step(time, simulator.last_forces());
      if (outputs.viewer) outputs.viewer->show(simulator);
    };
  const std::optional<FailedStep> failed = run_simulation(simulator, inputs, hooks, tally);
  // The trajectory ends with the last good state.
  if (outputs.steps.writer) outputs.steps.writer->write_end(simulator.state());
  if (outputs.steps.sensors) outputs.steps.sensors->finish();
  return failed;
}

/// Returns the reason why the run was stopped early without a failed step; empty if it was not.
std::string stopped(const RunTally& tally, const Simulator& simulator) {
  if (tally.interrupted)
    return fmt::format("stopped at {:.6g} s by Ctrl-C or SIGTERM", simulator.state().time);
  if (!(tally.wall_seconds > tally.wall_limit)) return {};
  return fmt::format("stopped at {:.6g} s after {:g} s of wall time, as --wall-limit asks",
                     simulator.state().time, tally.wall_limit);
}

/// Interval in steps between checks of energy and closures when no report is requested: about 500
/// checks per run suffice for a warning.
long looks_every(const Simulator& simulator) {
  constexpr double kLooks = 500.0;
  const SimulationOptions& options = simulator.options();
  return std::lround(options.duration / options.time_step / kLooks);
}

void write_report(SimulateArguments& arguments, const Simulator& simulator, const State& start,
                  const std::optional<FailedStep>& failed, const std::string& message,
                  const RunTally& tally) {
  const Model& model = simulator.model();
  const auto& control = simulator.options().step_control;
  Report& report = arguments.report;
  report.begin("simulate", arguments.scene.file);
  report["status"] = failed ? "failed" : message.empty() ? "ok" : "stopped";
  if (!message.empty()) report["message"] = message;
  if (failed) add_failure(model, *failed, report.json());
  report["time_step_s"] = simulator.options().time_step;
  tally.fill(simulator.state().time - start.time, report.json());
  if (control) report["step_control"] = step_control_report(*control, tally.control, simulator);
  report["energy_start_J"] = total_energy(model, start);
  report["energy_end_J"] = total_energy(model, simulator.state());
  report["start_time_s"] = start.time;
  report["state_hash"] = std::to_string(state_hash(simulator.state()));
  report.write();
}

void print_metrics(const Report& report, const Simulator& simulator, double simulated,
                   const RunTally& tally) {
  const double steps = static_cast<double>(std::max(tally.steps, 1L));
  report.print(
      "{} steps, {:.6g} s simulated in {:.3g} s; {:.3g} contacts and {:.3g} Newton iterations a "
      "step, deepest penetration {:.3g} m; state hash {}\n",
      tally.steps, simulated, tally.wall_seconds, tally.contacts / steps,
      tally.newton_iterations / steps, tally.max_penetration, state_hash(simulator.state()));
  if (tally.softened_steps > 0)
    report.print(
        "{} steps were solved with softer contacts, at most {:.3g} times, the first at {:.6g} "
        "s\n",
        tally.softened_steps, tally.softening_max, tally.softened_first);
  if (tally.unfinished_steps > 0)
    report.print(
        "{} steps were left unfinished by step_budget, residual at most {:.2g}, the first at "
        "{:.6g} s\n",
        tally.unfinished_steps, tally.unfinished_residual, tally.unfinished_first);
  if (tally.stays_open > 0) {
    const FaultText text = describe(simulator.model(), tally.stays_open_first);
    report.print("seen at {:.6g} s: {}\n", tally.stays_open_time, text.reason);
  }
  const std::string warning = tally.watch->warning();
  if (!warning.empty()) report.print("warning: {}\n", warning);
  if (simulator.options().step_control) report.print("{}\n", step_control_text(tally.control));
}

/// Sets the simulator to the start, time step and duration of the followed motion.
void follow(const SimulateArguments& arguments, const Follower& motion, Simulator& simulator) {
  if (simulator.options().step_control || arguments.time_step)
    throw InputError("--follow steps as the motion does: leave --adaptive and --timestep out");
  simulator.options().time_step = motion.time_step();
  if (!arguments.duration) simulator.options().duration = motion.duration();
  if (arguments.resume.empty())
    simulator.set_state(motion.start(simulator.model(), arguments.inputs.seed));
}

Outputs open_outputs(const SimulateArguments& arguments, const Simulator& simulator,
                     const AppliedInputs& inputs) {
  const Model& model = simulator.model();
  Outputs outputs{
      RunOutputs(arguments.output, arguments.view, simulator.scene(), inputs.columns(model)),
      {},
      {}};
  if (!arguments.contacts.empty() && simulator.options().integrator == Integrator::kRungeKutta4)
    throw InputError(
        "--contacts: forces are read off the motion, and runge_kutta_4 has no inverse");
  if (!arguments.contacts.empty())
    outputs.contacts = std::make_unique<ContactTable>(arguments.contacts, model);
  if (!arguments.sensors.empty())
    outputs.steps.sensors = std::make_unique<SensorLog>(arguments.sensors, model,
                                                        simulator.options(), arguments.inputs.seed);
  if (arguments.live) {
    Scene shown = simulator.scene();
    shown.q = simulator.state().q;
    shown.v = simulator.state().v;
    outputs.viewer = std::make_unique<live::Viewer>(std::move(shown), arguments.scene.file);
    fmt::print(stderr, "{}\n", outputs.viewer->address());
  }
  return outputs;
}

int simulate(SimulateArguments& arguments) {
  arguments.view.check();
  Scene scene = arguments.scene.load();
  override_step_control(arguments.adaptive, arguments.event_tolerance, scene.options);
  override_times(arguments.duration, arguments.time_step, scene.options);
  if (arguments.step_budget) scene.options.step_budget = *arguments.step_budget;
  for (const Note& note : collision::all_notes(scene.model)) {
    fmt::print(stderr, "note: {}: {}\n", note.where, note.message);
  }
  Simulator simulator(std::move(scene));
  const Model& model = simulator.model();
  if (!arguments.resume.empty()) {
    simulator.set_state(read_state(arguments.resume, model, simulator.options(),
                                   arguments.changed_scene ? SceneCheck::kAny : SceneCheck::kSame));
    if (const auto step = read_next_step(arguments.resume)) simulator.set_next_step(*step);
  }
  if (arguments.threads > 1) simulator.set_threads(arguments.threads);
  if (arguments.strict) simulator.settings().soften_after = 0;
  AppliedInputs inputs(arguments.inputs, simulator);
  if (inputs.follower() != nullptr) follow(arguments, *inputs.follower(), simulator);
  Outputs outputs = open_outputs(arguments, simulator, inputs);
  const State start = simulator.state();
  const Interrupt interrupt;
  RunTally tally;
  tally.wall_limit = arguments.wall_limit.value_or(tally.wall_limit);
  tally.watch =
      std::make_unique<RunWatch>(simulator, arguments.report.wanted() ? 1 : looks_every(simulator));
  const auto& control = simulator.options().step_control;
  const std::optional<FailedStep> failed = run(simulator, inputs, outputs, tally);
  Interrupt::end();
  if (!arguments.save_state.empty()) {
    write_state(arguments.save_state, model, simulator.options(), simulator.state(),
                control ? std::optional(simulator.next_step()) : std::nullopt);
  }
  if (outputs.steps.recorder)
    view::write_replay(arguments.view.file(), simulator.scene(),
                       {arguments.scene.file,
                        {arguments.inputs.file, arguments.resume},
                        arguments.scene.package_folders()},
                       outputs.steps.recorder->finish(simulator.state()));

  if (inputs.follower() != nullptr)
    arguments.report["follow_error_max"] = inputs.follower()->error_max();
  const std::string message = failed ? failure_message(model, *failed) : stopped(tally, simulator);
  write_report(arguments, simulator, start, failed, message, tally);
  if (message.empty()) {
    print_metrics(arguments.report, simulator, simulator.state().time - start.time, tally);
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
  auto [command, arguments] = line.add<SimulateArguments>(
      "simulate", "Simulate a scene; write its trajectory",
      "Example:\n  counterpoint simulate data/scenes/arm7.yaml --duration 1 "
      "--random-inputs 0.5 --output arm.csv --json arm.json",
      simulate);
  arguments.scene.add_to(command);
  add_times(command, arguments.duration, arguments.time_step);
  command.add("--adaptive TOL|off", arguments.adaptive,
              "Steps as long as the error allows: TOL is what a simulated second may add to any "
              "coordinate [m/s, rad/s]; or off. Default: the scene's step_control");
  command.add("--event-tolerance", arguments.event_tolerance,
              "With step control: impacts fall into steps of at most this [s]; default: the "
              "scene's, or 1e-6",
              seldom);
  command.add("--inputs", arguments.inputs.file,
              "Table of what acts: time, '<joint>.u', '<joint>.target', '<link>.fx' ...; a row "
              "holds until the next (docs/reference/trajectory-format.md)");
  add_follow(command, arguments.inputs.follow);
  add_random_inputs(command, arguments.inputs);
  command.add("--step-budget", arguments.step_budget,
              "Newton steps after which a step ends with contact forces that obey their laws only "
              "roughly; 0: no bound. Default: the scene's step_budget",
              not_negative, seldom);
  command.add("--threads N", arguments.threads,
              "Threads that share each step, to the same bits; pays for many robots or bodies that "
              "do not touch",
              positive, seldom);
  command.add("--strict", arguments.strict,
              "End at a step that cannot be solved, which else is solved with softer contacts, "
              "counted and recorded; and at a closure that stays open");
  command.add("--output", arguments.output,
              "Trajectory to write (docs/reference/trajectory-format.md)");
  command.add("--contacts", arguments.contacts,
              "Table to write: the contacts of every step and their forces, as `inverse "
              "--contacts` does; of a controlled step those of its second half");
  command.add("--sensors FILE", arguments.sensors,
              "Table to write: readings of sensors (docs/reference/sensors.md)");
  command.add("--save-state FILE", arguments.save_state,
              "Write the last state, to go on from to the same bits");
  Option& resume = command.add("--resume FILE", arguments.resume,
                               "Start from a state saved by --save-state, of the same scene; the "
                               "duration counts from there");
  command.add(
      "--changed-scene", arguments.changed_scene,
      "With --resume: the scene may have changed, and FILE may be a trajectory (its last row)",
      needs(resume), seldom);
  command.add("--wall-limit", arguments.wall_limit,
              "Stop, exit code 1, after this time in steps [s]; default: never", positive);
  command.add("--live", arguments.live,
              "Serve a page that shows the run as it goes; its address is printed");
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
