// counterpoint identify: fits scene parameters to some recordings and scores them on the others.
#include "command.h"
#include "command_line/interrupt.h"
#include "identify/search.h"
#include "input/motion.h"

namespace counterpoint::apps {
namespace {

/// Refuses sensors that the objective does not use.
void check_sensors(const IdentifyArguments& arguments, const ColumnMap& map) {
  if (arguments.objective != "explain") return refuse_sensors(map, "identify");
  if (!map.sources.empty())
    throw InputError(
        "identify: the column map has 'sources', which only `explain` reads; expected sensors in "
        "columns of the recordings");
}

Experiment make_experiment(const IdentifyArguments& arguments) {
  Experiment e{arguments.scene.load(), {}, {}, 0, {}};
  e.map = load_column_map(arguments.map, e.scene.model);
  check_sensors(arguments, e.map);
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

/// Splits the recordings into those that the parameters of the result are fitted to, and the rest.
Split split(const IdentifyArguments& arguments, const Experiment& e) {
  if (arguments.folds) {
    if (arguments.train || arguments.swap || !arguments.test.empty())
      throw InputError(
          "--folds: leave out --train, --test and --swap; each fold is scored in turn");
    return deal(e.num_given, 1.0);
  }
  Split out =
      deal(e.num_given,
           arguments.test.empty() ? arguments.train.value_or(e.num_given > 1 ? 0.5 : 1.0) : 1.0);
  for (int i = e.num_given; i < static_cast<int>(e.recordings.size()); ++i) out.test.push_back(i);
  if (arguments.swap) std::swap(out.train, out.test);
  if (out.train.empty())
    throw InputError("no recording is left to fit: expected a larger --train, or no --swap");
  return out;
}

/// Reports that Ctrl-C ended the search or the scoring. Returns the exit code.
int end_early(const char* figures, Report& report) {
  report["status"] = "stopped";
  report.write();
  return end_stopped(": the figures are {}", figures);
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

/// Refuses options that the objective does not use.
void check_options(const IdentifyArguments& arguments) {
  if (arguments.told_only && (arguments.objective == "explain" || arguments.folds ||
                              !arguments.output.empty() || !arguments.page.empty()))
    throw InputError(
        "--told-only fits nothing: leave out --folds, --output, --report and --objective explain, "
        "which finds the motions together with the parameters");
  const TorqueFitOptions usual;
  const bool torque = arguments.objective == "torque";
  if (torque || arguments.objective == "explain") refuse_search_options(arguments);
  if (!torque && (arguments.torques.cutoff != usual.cutoff ||
                  arguments.torques.rest_speed != usual.rest_speed))
    throw InputError("--cutoff, --rest-speed: these are for --objective torque");
}

/// Reports the last fit and its scores. Returns the exit code.
int report_found(IdentifyArguments& arguments, const Experiment& e,
                 const std::vector<Parameter>& parameters, const Split& parts, const Found& found,
                 IdentifySearch& search) {
  Report& report = arguments.report;
  const bool torque = arguments.objective == "torque";
  if (arguments.told_only && !found.fit.stopped) {
    report["status"] = "ok";
    fill_told(parameters, found.fit, report);
    report.write();
    return kSuccess;
  }
  fill_report(parameters, search.start(), found.fit, report);
  if (!arguments.output.empty())
    write_settings(arguments.output, arguments.scene.file, report["parameters"]);
  if (found.fit.stopped)
    return end_early(torque ? "the best found so far, without scores"
                            : "the best found so far, without intervals or scores",
                     report);
  fill_told(parameters, found.fit, report);
  if (torque) fill_torques(e.scene.model, found.torques, report);
  if (!search.score(found, parts, true, report.json()))
    return end_early("those found, without all scores", report);
  for (std::size_t c = 0; c < found.torques.channels.size(); ++c)
    report["channels"][c]["held"] = search.held()[static_cast<Eigen::Index>(c)];
  Interrupt::end();
  report.write();
  if (arguments.page.empty()) return kSuccess;
  if (torque)
    write_torque_page(arguments.page, arguments.scene.file, search.charts(), report.json());
  else
    write_identify_page(arguments.page, arguments.scene.file, search.shown(), compared(e.map),
                        report.json());
  return kSuccess;
}

int identify(IdentifyArguments& arguments, tasks::World& world) {
  arguments.report.begin("identify", arguments.scene.file);
  arguments.fit.exact = arguments.derivatives == "exact";
  if (arguments.told_only) arguments.fit.samples = arguments.fit.max_rounds = 0;
  const Experiment e = make_experiment(arguments);
  const std::vector<Parameter> parameters = parse_parameters(arguments.parameters, e.scene);
  const Split parts = split(arguments, e);
  const std::vector<Split> folds =
      arguments.folds ? folds_of(e.num_given, *arguments.folds) : std::vector<Split>();
  check_options(arguments);
  const Interrupt interrupt;
  const bool on_root = arguments.objective == "torque" || arguments.objective == "explain";
  if (on_root && !world.is_root()) return kSuccess;
  IdentifySearch search(arguments, e, parameters, world);
  if (!folds.empty() && !search.find_folds(folds))
    return !world.is_root() ? kSuccess
                            : end_early("those of the folds that were finished", arguments.report);
  const Found found = search.find(parts.train);
  if (!world.is_root()) return kSuccess;
  return report_found(arguments, e, parameters, parts, found, search);
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
              "What to find: KIND[:ELEMENT+...][=LOW..HIGH][~DEVIATION], comma separated, or @FILE",
              required);
  command.add("--substeps", arguments.substeps, "Time steps between two rows");
  command.add("--train", arguments.train,
              "Share of the recordings to fit, spread evenly; the others are scored (default 0.5; "
              "1 for a single recording)",
              range(0.0, 1.0));
  command.add("--folds", arguments.folds,
              "Fit N times, each without another part, which is scored; then all");
  command.add("--told-only", arguments.told_only,
              "Fit nothing; say what the recordings tell at the scene's values");
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
  command.add("--swap", arguments.swap, "Exchange the recordings fitted and scored", seldom);
  command.add("--horizon", arguments.horizon,
              "Rows between restarts from the recording; 0: start at its first row only",
              not_negative);
  command.add("--loss cauchy|squares", arguments.loss, "cauchy (default) or squares", seldom);
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
