// counterpoint rollout: computes many trajectories of one scene in parallel, over all cores and
// ranks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/engine/trajectory.h"
#include "input/applied_inputs.h"
#include "input/scene_arguments.h"
#include "report/failure.h"
#include "report/report.h"
#include "tasks/archive.h"
#include "tasks/fingerprint.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {
namespace {

struct RolloutArguments {
  SceneArguments scene;
  std::optional<double> duration, time_step;
  int count = 16;
  tasks::TaskArguments tasks;
  std::vector<std::string> inputs;
  InputArguments random;  ///< its seed is the one of rollout 0
  bool invert = false;
  std::string output;
  Report report;
};

/// Result of one trajectory: its end, and the error of the forces that the inverse recovers.
struct Rollout {
  State end;
  long steps = 0, softened = 0, unfinished = 0;
  double force_error = 0.0, force_scale = 0.0;  ///< largest values [N, N m], with --invert
  std::string failure, failure_json;  ///< reason of a failed step (text, report), or empty
  bool begun = false,
       stopped = false;  ///< Ctrl-C ended it before the first step or the last
  bool failed() const { return !failure.empty(); }

  template <class Archive>
  void serialize(Archive& a) {
    a(end.time, end.q, end.v, steps, softened, unfinished, force_error, force_scale, failure,
      failure_json, begun, stopped);
  }
};

InputArguments inputs_of(const RolloutArguments& arguments, int rollout) {
  InputArguments inputs = arguments.random;
  if (!arguments.inputs.empty())
    inputs.file = arguments.inputs[arguments.inputs.size() == 1 ? 0 : static_cast<size_t>(rollout)];
  inputs.seed += static_cast<std::uint64_t>(rollout);
  return inputs;
}

Rollout roll_out(const RolloutArguments& arguments, int index, Simulator& simulator) {
  Rollout result;
  simulator.reset();
  simulator.input() = Input{VectorX::Zero(simulator.model().nv()), {}};
  AppliedInputs inputs(inputs_of(arguments, index), simulator);
  const SimulationOptions& options = simulator.options();
  const long steps = std::lround(std::ceil(options.duration / options.time_step - 1e-6));
  State before;
  result.begun = true;
  for (; result.steps < steps; ++result.steps) {
    result.stopped = Interrupt::wanted();
    if (result.stopped) break;
    inputs.set(simulator);
    if (arguments.invert) before = simulator.state();
    const StepReport step = simulator.step();
    if (!step.succeeded()) {
      const FailedStep failed{result.steps, simulator.state().time, step};
      result.failure = failure_message(simulator.model(), failed);
      Json json;
      add_failure(simulator.model(), failed, json);
      result.failure_json = json.dump();
      break;
    }
    result.softened += step.softening.softens() ? 1 : 0;
    result.unfinished += step.softening.unfinished() ? 1 : 0;
    if (!arguments.invert || step.softening.unfinished()) continue;
    simulator.input().softening = step.softening;  // the laws that were solved
    find_taut_links(simulator.state(), simulator.input().taut_links);
    const Inverse& inverse =
        simulator.inverse(before.q, before.v, simulator.state().q, simulator.state().v);
    simulator.input().softening = {};
    simulator.input().taut_links.clear();
    result.force_error = std::max(
        result.force_error,
        (inverse.applied_force - simulator.input().applied_force).lpNorm<Eigen::Infinity>());
    result.force_scale = std::max(result.force_scale, inverse.force_scale);
  }
  result.end = simulator.state();
  return result;
}

/// Writes a row for each rollout, with its last good state.
void write_ends(const std::string& file, const Model& model, const std::vector<Rollout>& rollouts) {
  const CoordinateNames names = coordinate_names(model);
  std::vector<Column> columns{"rollout", "failed", "steps", "time"};
  columns.insert(columns.end(), names.q.begin(), names.q.end());
  columns.insert(columns.end(), names.v.begin(), names.v.end());
  columns.emplace_back(kStateHashColumn, CellType::kInteger);
  TableWriter table(file, columns);
  for (size_t i = 0; i < rollouts.size(); ++i) {
    const Rollout& r = rollouts[i];
    if (!r.begun) continue;
    table.number(static_cast<double>(i));
    table.number(r.failed() ? 1.0 : 0.0);
    table.number(static_cast<double>(r.steps));
    table.number(r.end.time);
    for (const double x : r.end.q) table.number(x);
    for (const double x : r.end.v) table.number(x);
    table.integer(state_hash(r.end));
    table.end_row();
  }
  table.finish();
}

const char* status_of(const Rollout& rollout) {
  if (rollout.failed()) return "failed";
  if (!rollout.begun) return "not begun";
  return rollout.stopped ? "stopped" : "ok";
}

/// Counts over all rollouts.
struct Tally {
  long steps = 0, softened = 0, unfinished = 0, failures = 0, stopped = 0, begun = 0;
  double force_error = 0.0, force_scale = 0.0;

  explicit Tally(const std::vector<Rollout>& rollouts) {
    for (const Rollout& rollout : rollouts) {
      steps += rollout.steps;
      softened += rollout.softened;
      unfinished += rollout.unfinished;
      failures += rollout.failed() ? 1 : 0;
      stopped += rollout.begun && rollout.stopped ? 1 : 0;
      begun += rollout.begun ? 1 : 0;
      force_error = std::max(force_error, rollout.force_error);
      force_scale = std::max(force_scale, rollout.force_scale);
    }
  }
  bool ended_early(const RolloutArguments& arguments) const {
    return stopped > 0 || begun < arguments.count;
  }
};

/// Hash of everything that the rollouts depend on.
std::uint64_t fingerprint(const RolloutArguments& arguments, const Scene& scene) {
  tasks::Fingerprint hash;
  hash.add_scene(scene);
  for (const std::string& file : arguments.inputs) hash.add_file(file);
  hash.add(arguments.random.random_scale);
  hash.add(arguments.random.random_wrench_scale);
  hash.add(arguments.random.seed);
  hash.add(static_cast<int>(arguments.invert));
  return hash.value();
}

tasks::TaskList task_list(const RolloutArguments& arguments, const Scene& scene) {
  tasks::TaskList list;
  list.name = "rollouts";
  list.count = arguments.count;
  list.fingerprint = fingerprint(arguments, scene);
  list.make_task = [&arguments, &scene]() -> tasks::Task {
    return [&arguments, simulator = std::make_shared<Simulator>(scene)](std::int64_t i) {
      const Rollout rollout = roll_out(arguments, static_cast<int>(i), *simulator);
      return tasks::Outcome{tasks::to_bytes(rollout), !rollout.stopped};
    };
  };
  return list;
}

std::vector<Rollout> collect(const RolloutArguments& arguments, const tasks::Results& results) {
  std::vector<Rollout> rollouts(static_cast<size_t>(arguments.count));
  results.for_each([&](std::int64_t i, std::string&& bytes) {
    rollouts[static_cast<size_t>(i)] = tasks::from_bytes<Rollout>(bytes);
  });
  return rollouts;
}

void fill_report(const RolloutArguments& arguments, const tasks::Results& results,
                 const std::vector<Rollout>& rollouts, const Tally& tally, Report& report) {
  const double rate =
      results.seconds > 0.0 ? static_cast<double>(tally.steps) / results.seconds : 0.0;
  report["status"] = tally.failures > 0             ? "failed"
                     : tally.ended_early(arguments) ? "stopped"
                                                    : "ok";
  report["rollouts"] = arguments.count;
  report["failed_rollouts"] = tally.failures;
  report["finished_rollouts"] = tally.begun - tally.stopped - tally.failures;
  add_run(results, report);
  report["steps"] = tally.steps;
  report["softened_steps"] = tally.softened;
  report["unfinished_steps"] = tally.unfinished;
  report["steps_per_second"] = rate;
  report["steps_per_second_and_thread"] = rate / (results.ranks * results.threads);
  if (arguments.invert) {
    report["force_error_max"] = tally.force_error;
    report["force_scale_max"] = tally.force_scale;
  }
  Json list = Json::array();
  for (size_t i = 0; i < rollouts.size(); ++i) {
    Json one{{"rollout", i}, {"status", status_of(rollouts[i])}};
    if (rollouts[i].begun) {
      one["end_time_s"] = rollouts[i].end.time;
      one["state_hash"] = std::to_string(state_hash(rollouts[i].end));
    }
    if (rollouts[i].failed()) one.update(Json::parse(rollouts[i].failure_json));
    list.push_back(one);
  }
  report["results"] = list;
}

void print(const tasks::Results& results, const Tally& tally, const Report& report) {
  const int threads = results.ranks * results.threads;
  report.print_entries("{rollouts} rollouts, {steps} steps in {wall_seconds:.3g} s on ");
  report.print("{} thread{}", threads, threads == 1 ? "" : "s");
  report.print_entries(
      ": {steps_per_second:.4g} steps a second, {steps_per_second_and_thread:.4g} a thread\n");
  if (tally.softened > 0)
    report.print_entries("{softened_steps} steps were solved with softer contacts\n");
  if (tally.unfinished > 0)
    report.print_entries("{unfinished_steps} steps were left unfinished by step_budget\n");
  if (report.has("force_error_max"))
    report.print("inverse: applied forces to {:.2g} of the largest force ({:.3g} N or N m)\n",
                 tally.force_scale > 0.0 ? tally.force_error / tally.force_scale : 0.0,
                 tally.force_scale);
}

int rollout(RolloutArguments& arguments, tasks::World& world) {
  if (arguments.inputs.size() > 1 && static_cast<int>(arguments.inputs.size()) != arguments.count)
    throw InputError(
        fmt::format("--inputs: {} files for {} rollouts; expected none, one for all, or one each",
                    arguments.inputs.size(), arguments.count));
  Scene scene = arguments.scene.load();
  override_times(arguments.duration, arguments.time_step, scene.options);
  if (arguments.invert && scene.options.integrator == Integrator::kRungeKutta4)
    throw InputError(
        "--invert: runge_kutta_4 has no inverse; use implicit_midpoint or semi_implicit_euler");
  const Interrupt interrupt;
  arguments.report.begin("rollout", arguments.scene.file);
  const tasks::Results results =
      arguments.tasks.run_last(world, task_list(arguments, scene), Interrupt::wanted, true);
  Interrupt::end();
  if (!world.is_root()) return kSuccess;
  const std::vector<Rollout> rollouts = collect(arguments, results);
  const Tally tally(rollouts);
  fill_report(arguments, results, rollouts, tally, arguments.report);
  arguments.report.write();
  if (!arguments.output.empty()) write_ends(arguments.output, scene.model, rollouts);
  print(results, tally, arguments.report);
  for (size_t i = 0; i < rollouts.size(); ++i)
    if (rollouts[i].failed()) fmt::print(stderr, "error: rollout {}: {}\n", i, rollouts[i].failure);
  if (!tally.ended_early(arguments)) return tally.failures > 0 ? kFailed : kSuccess;
  return end_stopped(
      ": {} of {} rollouts ended, {} were under way, {} not begun{}", tally.begun - tally.stopped,
      arguments.count, tally.stopped, arguments.count - tally.begun,
      arguments.output.empty()
          ? ""
          : fmt::format("; {} has a row for each rollout that was begun: its last state",
                        arguments.output));
}

}  // namespace

void add_rollout(CommandLine& line) {
  auto [command, arguments] = line.add<RolloutArguments>(
      "rollout", "Simulate a scene many times at once, over all cores and machines",
      "Rollout i (from 0) gives the bits of `counterpoint simulate` with seed + i.\n"
      "Example:\n  counterpoint rollout data/scenes/humanoid_drop.yaml --count 100 "
      "--random-inputs 0.5 --output ends.csv --json rollout.json",
      on_every_rank(rollout));
  arguments.scene.add_to(command);
  command.add("--count", arguments.count, "Number of rollouts; default 16", range(1, 10000000));
  arguments.tasks.add_to(command);
  add_times(command, arguments.duration, arguments.time_step);
  command.add("--inputs FILE ...", arguments.inputs,
              "Table of what acts, as in simulate: one file for all rollouts, or one each");
  add_random_inputs(command, arguments.random);
  command.add("--invert", arguments.invert,
              "Recover the applied forces of every step, and say how well");
  command.add("--output", arguments.output,
              "Table to write: a row for each rollout, its last state");
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
