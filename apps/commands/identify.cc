// counterpoint identify: fits scene parameters to some recordings and scores them on the others.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "command.h"
#include "command_line/interrupt.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "recordings/estimation.h"
#include "recordings/identify_report.h"
#include "recordings/page.h"
#include "report/report.h"
#include "tasks/fingerprint.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {
namespace {

struct IdentifyArguments {
  SceneArguments scene;
  std::vector<std::string> recordings, test;
  std::string map, parameters, set, output, page, loss = "cauchy", objective = "score";
  std::optional<int> substeps;
  std::optional<double> train;
  std::string derivatives = "exact";
  int horizon = 0;
  bool swap = false;
  FitOptions fit;
  TorqueFitOptions torques;
  tasks::TaskArguments tasks;
  Report report;
};

Experiment make_experiment(const IdentifyArguments& arguments) {
  Experiment e{with_settings(arguments.scene.load(), arguments.set), {}, {}, 0, {}};
  e.map = load_column_map(arguments.map, e.scene.model);
  refuse_sensors(e.map, "identify");
  e.prediction = {arguments.substeps ? arguments.substeps : e.map.substeps,
                  e.scene.options.time_step, arguments.horizon, Interrupt::wanted};
  const bool by_forces = arguments.objective == "force" || arguments.objective == "explain" ||
                         arguments.objective == "torque";
  if (compared(e.map) == Compared::kImpacts && by_forces)
    throw InputError("--objective " + arguments.objective +
                     ": an impact takes no time, forces are not to be had");
  e.by_score = arguments.objective == "score";
  if (arguments.objective == "one-step") e.prediction.horizon = 1;
  e.reach = e.scene.options.contact.margin;
  e.recordings = read_with_notes(arguments.recordings, e.map, e.scene);
  e.num_given = static_cast<int>(e.recordings.size());
  for (Recording& one : read_with_notes(arguments.test, e.map, e.scene))
    e.recordings.push_back(std::move(one));
  return e;
}

/// Indices of the recordings to fit, and of those to predict with the parameters found.
struct Split {
  std::vector<int> train, test;
};

/// Splits the recordings evenly in the given order, without random numbers.
Split split(const IdentifyArguments& arguments, const Experiment& e) {
  Split out;
  const double share = arguments.train.value_or(e.num_given > 1 ? 0.5 : 1.0);
  for (int i = 0; i < static_cast<int>(e.recordings.size()); ++i) {
    const bool train = arguments.test.empty()
                           ? std::ceil((i + 1) * share - 1e-9) > std::ceil(i * share - 1e-9)
                           : i < e.num_given;
    (train ? out.train : out.test).push_back(i);
  }
  if (arguments.swap) std::swap(out.train, out.test);
  if (out.train.empty())
    throw InputError("no recording is left to fit: expected a larger --train, or no --swap");
  return out;
}

std::uint64_t fingerprint(const IdentifyArguments& a, const Experiment& e) {
  tasks::Fingerprint hash;
  hash.add_scene(e.scene);
  hash.add_file(a.map);
  for (const auto* files : {&a.recordings, &a.test}) {
    hash.add(static_cast<std::uint64_t>(files->size()));
    for (const std::string& file : *files) hash.add_file(file);
  }
  for (const std::string* text : {&a.parameters, &a.loss, &a.objective, &a.derivatives})
    hash.add(std::string_view(*text));
  for (const int number : {a.substeps.value_or(0), a.horizon, a.swap ? 1 : 0, a.fit.samples,
                           a.fit.refined, a.fit.bootstrap})
    hash.add(number);
  hash.add(a.train.value_or(-1.0));
  hash.add(a.fit.difference);
  return hash.value();
}

/// Reports that Ctrl-C ended the search or the scoring. Returns the exit code.
int end_early(const char* figures, Report& report) {
  report["status"] = "stopped";
  report.write();
  return end_stopped(": the figures are {}", figures);
}

/// Finds the parameters with the best predictions. Every rank takes part.
Fit predicted_best(IdentifyArguments& arguments, const Experiment& e,
                   const std::vector<Parameter>& parameters, const std::vector<int>& which,
                   tasks::World& world) {
  const FitProblem problem = fit_problem(e, parameters, which, arguments.objective == "force");
  arguments.fit.robust = arguments.loss == "cauchy";
  arguments.fit.stop = Interrupt::wanted;
  tasks::RunSeries series(arguments.tasks, world, Interrupt::wanted, last_fit_list(arguments.fit));
  arguments.fit.run = series.runner();
  arguments.fit.fingerprint = fingerprint(arguments, e);
  Fit found = fit(problem, arguments.fit);
  series.finish();
  arguments.report["ranks"] = series.last().ranks;
  arguments.report["threads"] = series.last().threads;
  return found;
}

/// Refuses options of the search from many points, for objectives that need none.
void refuse_search_options(const IdentifyArguments& arguments) {
  const FitOptions &given = arguments.fit, usual;
  const std::string& objective = arguments.objective;
  if (arguments.tasks.is_share())
    throw InputError("--tasks: with --objective " + objective + " all recordings are one task");
  if (given.samples != usual.samples || given.refined != usual.refined || given.bootstrap > 0 ||
      given.difference != usual.difference || !given.exact || arguments.loss != "cauchy" ||
      arguments.horizon > 0)
    throw InputError("--objective " + objective +
                     ": leave out --samples, --refined, --bootstrap, --difference, --derivatives, "
                     "--horizon and --loss");
}

/// Refuses options of --objective torque with any other.
void refuse_torque_options(const IdentifyArguments& arguments) {
  const TorqueFitOptions usual;
  if (arguments.torques.cutoff != usual.cutoff || arguments.torques.rest_speed != usual.rest_speed)
    throw InputError("--cutoff, --rest-speed: these are for --objective torque");
}

/// Finds the parameters and motions that explain the recordings, as one problem on rank 0.
Fit explained_best(IdentifyArguments& arguments, const Experiment& e,
                   const std::vector<Parameter>& parameters, const std::vector<int>& which,
                   tasks::World& world) {
  refuse_search_options(arguments);
  if (!world.is_root()) return {};
  std::vector<const Recording*> recordings;
  for (const int i : which) recordings.push_back(&e.recordings[static_cast<std::size_t>(i)]);
  MotionEstimateOptions options;
  options.threads = arguments.tasks.threads(world);
  options.stop = Interrupt::wanted;
  const ParameterEstimate found =
      estimate_parameters(e.scene, e.map, recordings, parameters, options);
  Report& report = arguments.report;
  report["ranks"] = 1;
  report["threads"] = options.threads;
  report["smoothing_m"] = found.smoothing;
  report["cost_ratio"] = std::vector<double>(found.cost_ratio.begin(), found.cost_ratio.end());
  report.print("{} motions explained, {} Newton steps\n", recordings.size(),
               found.parameters.evaluations);
  return found.parameters;
}

/// Writes the file of --output, if that is given.
void write_output(IdentifyArguments& arguments) {
  if (!arguments.output.empty())
    write_settings(arguments.output, arguments.scene.file, arguments.report["parameters"]);
}

std::vector<const Recording*> chosen(const Experiment& e, const std::vector<int>& which) {
  std::vector<const Recording*> out;
  for (const int i : which) out.push_back(&e.recordings[static_cast<std::size_t>(i)]);
  return out;
}

/// Fits recorded joint forces on rank 0, and reports.
int identify_torques(IdentifyArguments& arguments, const Experiment& e,
                     const std::vector<Parameter>& parameters, const Split& parts,
                     tasks::World& world) {
  refuse_search_options(arguments);
  if (!world.is_root()) return kSuccess;
  Report& report = arguments.report;
  arguments.torques.threads = arguments.tasks.threads(world);
  arguments.torques.stop = Interrupt::wanted;
  const TorqueFit found =
      fit_torques(e.scene, e.map, chosen(e, parts.train), parameters, arguments.torques);
  report["ranks"] = 1;
  report["threads"] = arguments.torques.threads;
  const VectorX start = parameter_values(parameters, e.scene);
  fill_report(parameters, start, found.parameters, report);
  write_output(arguments);
  if (found.parameters.stopped) return end_early("the best found so far, without scores", report);
  fill_told(parameters, e.scene.model, found, report);
  const VectorX values = found.parameters.values();
  const Scene after = with_parameters(e.scene, parameters, values);
  VectorX held;  // at rest, in the recordings that were fitted
  for (const auto& [name, which] :
       {std::pair{"train", &parts.train}, std::pair{"test", &parts.test}}) {
    if (which->empty()) continue;
    const auto recordings = chosen(e, *which);
    const TorqueScore before =
        score_torques(e.scene, e.map, recordings, parameters, start, arguments.torques, held);
    const TorqueScore now =
        score_torques(after, e.map, recordings, parameters, values, arguments.torques, held);
    if (held.size() == 0) held = now.held;
    report.print("{}: {} recordings\n", name, which->size());
    Json& coordinates = report[name]["coordinates"];
    coordinates = {{"scene", coordinate_list(before.coordinates)},
                   {"found", coordinate_list(now.coordinates)}};
    print_coordinates(coordinates, report);
    report[name]["recordings"] = which->size();
    for (std::size_t c = 0; c < found.channels.size(); ++c)
      report["channels"][c]["held"] = held[static_cast<Eigen::Index>(c)];
  }
  Interrupt::end();
  report.write();
  if (!arguments.page.empty())
    write_torque_page(arguments.page, arguments.scene.file, report.json());
  return kSuccess;
}

int identify(IdentifyArguments& arguments, tasks::World& world) {
  arguments.report.begin("identify", arguments.scene.file);
  arguments.fit.exact = arguments.derivatives == "exact";
  const Experiment e = make_experiment(arguments);
  const std::vector<Parameter> parameters = parse_parameters(arguments.parameters, e.scene);
  const Split parts = split(arguments, e);
  const Interrupt interrupt;
  if (arguments.objective == "torque")
    return identify_torques(arguments, e, parameters, parts, world);
  refuse_torque_options(arguments);
  const auto search = arguments.objective == "explain" ? explained_best : predicted_best;
  const Fit found = search(arguments, e, parameters, parts.train, world);
  if (!world.is_root()) return kSuccess;

  Report& report = arguments.report;
  fill_report(parameters, parameter_values(parameters, e.scene), found, report);
  write_output(arguments);
  if (found.stopped) return end_early("the best found so far, without intervals or scores", report);
  print_untold(parameters, found, report);
  const Scene after = with_parameters(e.scene, parameters, found.values());
  const Compared by = compared(e.map);
  Rollouts shown;  // the recordings that were not fitted, or all if all were fitted
  for (const auto& [name, which] :
       {std::pair{"train", &parts.train}, std::pair{"test", &parts.test}}) {
    if (which->empty()) continue;
    shown = roll_out(e, after, *which);
    if (Interrupt::wanted()) break;
    report[name] = score(shown, by);
    print_score(name, report[name], report);
    Json& coordinates = report[name]["coordinates"];
    const auto add = [&, which = which](const char* key, const Scene& scene,
                                        const std::vector<Prediction>& set) {
      coordinates[key] =
          coordinate_list(arguments.objective == "force" ? unexplained_metrics(e, scene, *which)
                                                         : velocity_metrics(e.map, set));
    };
    add("scene", e.scene, shown.before);
    add("found", after, shown.after);
    print_coordinates(coordinates, report);
  }
  if (Interrupt::wanted()) return end_early("those found, without all scores", report);
  Interrupt::end();
  report.write();
  if (!arguments.page.empty())
    write_identify_page(arguments.page, arguments.scene.file, shown, by, report.json());
  return kSuccess;
}

}  // namespace

void add_identify(CommandLine& line) {
  auto [command, arguments] = line.add<IdentifyArguments>(
      "identify", "Find figures of a scene with which it predicts recordings best",
      "Example:\n  counterpoint identify data/scenes/cube_toss.yaml toss_*.csv --columns "
      "data/maps/cube_toss.yaml --parameters friction=0.05..0.5,restitution=0..0.5",
      on_every_rank(identify));
  arguments.scene.add_to(command);
  command.add("RECORDING", arguments.recordings, "Recordings (any table)", required);
  command.add("--columns", arguments.map, "Column map (docs/guide/recordings.md)", required);
  command.add("--parameters", arguments.parameters,
              "What to find: KIND[:ELEMENT][=LOW..HIGH], comma separated", required);
  command.add("--set", arguments.set, "Figures to set first: KIND[:ELEMENT]=VALUE,...");
  command.add("--substeps", arguments.substeps, "Time steps between two rows");
  command.add("--train", arguments.train,
              "Share of the recordings to fit, spread evenly; the others are scored (default 0.5; "
              "1 for a single recording)",
              range(0.0, 1.0));
  command.add("--test", arguments.test, "Recordings to score; all others are fitted");
  command.add(
      "--objective score|rows|one-step|force|torque|explain", arguments.objective,
      "Minimized: score (default; mean deviations of each recording), rows (squared "
      "deviations at every row), one-step (rows, from every row to the next), force "
      "(unexplained by compare --mode inverse), torque (recorded joint forces of what touches "
      "nothing; tells what the recordings cannot tell), explain (unexplained by any motion)");
  command.add("--cutoff", arguments.torques.cutoff,
              "With --objective torque: -3 dB frequency of the filter of forces [Hz]; default 10",
              positive);
  command.add("--rest-speed", arguments.torques.rest_speed,
              "With --objective torque: slower joints with dry friction rest [rad/s, m/s]; default "
              "0",
              not_negative);
  command.add("--swap", arguments.swap, "Exchange the recordings fitted and scored");
  command.add("--horizon", arguments.horizon,
              "Rows between restarts from the recording; 0: start at its first row only",
              not_negative);
  command.add("--loss cauchy|squares", arguments.loss, "cauchy (default) or squares");
  command.add("--samples", arguments.fit.samples, "Points tried before any is refined",
              range(0, 1'000'000));
  command.add("--refined", arguments.fit.refined, "Points refined", range(1, 1000), seldom);
  command.add("--difference", arguments.fit.difference,
              "Last step of the differences, as a share of the range (default 1e-3)",
              range(1e-9, 0.03), seldom);
  command.add("--derivatives exact|differences", arguments.derivatives,
              "exact (default: where steps have closed forms) or differences", seldom);
  command.add("--bootstrap", arguments.fit.bootstrap, "Refits to recordings drawn anew",
              range(0, 100'000));
  command.add("--output FILE", arguments.output,
              "Parameters found, a line each, to read, and for --set @FILE (export --set: as URDF, "
              "MJCF)");
  command.add("--report DIR", arguments.page, "Folder for a page with tables and pictures");
  arguments.tasks.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
