// counterpoint excite: designs a motion that tells parameters of a mechanism well.
#include <fmt/format.h>

#include <algorithm>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/engine/estimate/excitation.h"
#include "counterpoint/engine/trajectory.h"
#include "input/scene_arguments.h"
#include "recordings/estimation.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

struct ExciteArguments {
  SceneArguments scene;
  std::string parameters, output;
  double rate = 100.0;
  ExcitationOptions options;
  Report report;
};

/// Time [s] of the first row at which shapes touch, or nearly; none if none do.
std::optional<double> first_touch(const Scene& scene, const Excitation& motion) {
  Explainer explainer(scene, {}, scene.options.contact.margin);
  Recording recording;
  recording.time = motion.time;
  recording.q = motion.q;
  recording.v = motion.v;
  recording.applied_force = motion.force;
  for (int row = 0; row + 1 < recording.num_rows(); ++row)
    if (explainer.explain(recording, row, motion.time[1] - motion.time[0]).contacts > 0)
      return motion.time[static_cast<std::size_t>(row)];
  return std::nullopt;
}

void write(const std::string& file, const Model& model, const Excitation& motion) {
  TrajectoryWriter writer(file, model);
  const auto state = [&](std::size_t row) {
    const auto column = static_cast<Eigen::Index>(row);
    return State{motion.time[row], motion.q.col(column), motion.v.col(column)};
  };
  Input input;
  for (std::size_t row = 0; row + 1 < motion.time.size(); ++row) {
    input.applied_force = motion.force.col(static_cast<Eigen::Index>(row));
    writer.write_step(state(row), input, motion.time[row + 1] - motion.time[row]);
  }
  writer.write_end(state(motion.time.size() - 1));
}

/// Largest share of its effort limit that a joint needs.
double effort_share(const Model& model, const Excitation& motion) {
  double most = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i)
    most = std::max(most, motion.force.row(model.body(i).v_index).cwiseAbs().maxCoeff() /
                              model.joint(i - 1).effort_limit);
  return most;
}

int excite_scene(ExciteArguments& arguments) {
  const Scene scene = arguments.scene.load();
  const std::vector<Parameter> parameters = parse_parameters(arguments.parameters, scene);
  const Interrupt interrupt;
  arguments.options.stop = Interrupt::wanted;
  const Excitation motion = excite(scene, parameters, arguments.rate, arguments.options);
  Interrupt::end();
  write(arguments.output, scene.model, motion);
  Report& report = arguments.report;
  report.begin("excite", arguments.scene.file);
  report["status"] = motion.stopped ? "stopped" : "ok";
  report["condition"] = motion.condition;
  report["random_condition"] = motion.random_condition;
  report["told"] = motion.told;
  report["effort_share_max"] = effort_share(scene.model, motion);
  const std::optional<double> touch = first_touch(scene, motion);
  report["touches_s"] = touch ? Json(*touch) : Json();
  report.print(
      "condition number {:.4g} (best of {} random motions {:.4g}) over the {} of {} "
      "directions that motions tell; effort up to {:.0f} % of the limits\n",
      motion.condition, arguments.options.random_starts, motion.random_condition, motion.told,
      parameters.size(), 100.0 * report["effort_share_max"].get<double>());
  if (touch)
    fmt::print(stderr, "warning: shapes touch, or nearly, at {:.4g} s; try another --seed\n",
               *touch);
  report.write();
  return motion.stopped ? end_stopped("; {} is the best motion so far", arguments.output)
                        : kSuccess;
}

}  // namespace

void add_excite(CommandLine& line) {
  auto [command, arguments] = line.add<ExciteArguments>(
      "excite", "Design a motion whose joint forces tell parameters well",
      "Example:\n  counterpoint excite data/scenes/arm7.yaml --parameters 'inertial:*' --output "
      "motion.csv",
      excite_scene);
  arguments.scene.add_to(command);
  command.add("--parameters", arguments.parameters,
              "Parameters to tell: KIND[:ELEMENT][=LOW..HIGH], comma separated, as for identify",
              required);
  command.add("--output", arguments.output,
              "Trajectory to write: the periodic motion and its forces", required);
  command.add("--duration", arguments.options.duration, "Period of the motion [s]; default 10",
              positive);
  command.add("--harmonics", arguments.options.harmonics, "Sines for each joint; default 5",
              range(1, 100));
  command.add("--speed", arguments.options.speed,
              "Largest speed of a joint [rad/s, m/s]; default 2", positive);
  command.add("--rate", arguments.rate, "Rows a second [1/s]; default 100", positive);
  command.add("--random", arguments.options.random_starts,
              "Random motions, of which the best is improved; default 100", range(1, 1'000'000));
  command.add("--iterations", arguments.options.iterations, "Most steps of the search; default 60",
              not_negative);
  command.add("--seed", arguments.options.seed, "Seed of the random motions; default 1");
  command.add("--threads", arguments.options.threads, "Threads; default: one a core", not_negative);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
