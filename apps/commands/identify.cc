// counterpoint identify: fits scene parameters to some recordings and scores them on the others.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "command.h"
#include "command_line/interrupt.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "recordings/estimation.h"
#include "recordings/page.h"
#include "report/report.h"
#include "tasks/fingerprint.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {
namespace {

struct IdentifyArguments {
  SceneArguments scene;
  std::vector<std::string> recordings, test;
  std::string map, parameters, set, page, loss = "cauchy", objective = "score";
  std::optional<int> substeps;
  std::optional<double> train;
  std::string derivatives = "exact";
  int horizon = 0;
  bool swap = false;
  FitOptions fit;
  tasks::TaskArguments tasks;
  Report report;
};

Experiment make_experiment(const IdentifyArguments& arguments) {
  Experiment e{with_settings(arguments.scene.load(), arguments.set), {}, {}, 0, {}};
  e.map = load_column_map(arguments.map, e.scene.model);
  refuse_sensors(e.map, "identify");
  e.prediction = {arguments.substeps ? arguments.substeps : e.map.substeps,
                  e.scene.options.time_step, arguments.horizon, Interrupt::wanted};
  const bool by_forces = arguments.objective == "force" || arguments.objective == "explain";
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

Json json_metrics(const std::vector<Prediction>& predictions, Compared by) {
  Json out = Json::object();
  for (const auto& [name, value] : median_metrics(predictions, by)) out[name] = value;
  return out;
}

/// Predictions of whole recordings, by the scene before and after the fit.
struct Rollouts {
  std::vector<Prediction> before, after;
};

Rollouts roll_out(Experiment e, const Scene& found, const std::vector<int>& which) {
  e.prediction.horizon = 0;
  return {predict_all(e, e.scene, which), predict_all(e, found, which)};
}

Json score(const Rollouts& rollouts, Compared by) {
  const auto& [before, after] = rollouts;
  int better = 0;
  for (size_t i = 0; i < before.size(); ++i)
    better += metrics(after[i], by)[0].second < metrics(before[i], by)[0].second;
  return {{"recordings", before.size()},
          {"better", better},
          {"scene", json_metrics(before, by)},
          {"found", json_metrics(after, by)}};
}

/// Returns a number, or a dash for null.
std::string number_text(const Json& value) {
  return value.is_number() ? fmt::format("{:.5g}", value.get<double>()) : std::string("-");
}

void print_score(const char* title, const Json& score, const Report& report) {
  report.print("{}: {}", title,
               format_entries("{recordings} recordings, {better} of them predicted better; median "
                              "as the scene is / as found\n",
                              score));
  const Json& found = score["found"];
  for (const auto& [name, value] : score["scene"].items())
    if (found.contains(name))
      report.print("  {:<26} {:10.5g} {:10.5g}\n", name, value.get<double>(),
                   found[name].get<double>());
}

void print_coordinates(const Json& coordinates, const Report& report) {
  const auto number = [](const Json& x) {
    return x.is_null() ? std::string("-") : fmt::format("{:.4g}", x.get<double>());
  };
  report.print("  rms of the difference and R2, as the scene is / as found\n");
  const size_t count = std::min(coordinates["scene"].size(), coordinates["found"].size());
  for (size_t i = 0; i < count; ++i) {
    const Json &before = coordinates["scene"][i], &after = coordinates["found"][i];
    report.print("  {:<26} {:>10} {:>10} {:>10} {:>10}\n", before["name"].get<std::string>(),
                 number(before["rms"]), number(after["rms"]), number(before["r2"]),
                 number(after["r2"]));
  }
}

Json json_parameter(const Parameter& parameter, double scene, const FittedParameter& found) {
  const auto number = [](const std::optional<Interval>& i, double Interval::*side) {
    return i ? Json((*i).*side) : Json();
  };
  return {{"name", parameter.name},
          {"unit", parameter.unit},
          {"scene", scene},
          {"value", found.value},
          {"lower_95", number(found.interval, &Interval::lower)},
          {"upper_95", number(found.interval, &Interval::upper)},
          {"bootstrap_lower_95", number(found.bootstrap, &Interval::lower)},
          {"bootstrap_upper_95", number(found.bootstrap, &Interval::upper)},
          {"identifiable", found.interval.has_value()},
          {"lower_bound", parameter.lower},
          {"upper_bound", parameter.upper},
          {"at_bound", found.at_bound}};
}

void print_parameter(const Json& p, const Report& report) {
  std::string interval = "not identifiable", bootstrap;
  if (p["identifiable"])
    interval =
        p["lower_95"].is_null() ? "" : format_entries("{lower_95:.5g} ... {upper_95:.5g}", p);
  if (!p["bootstrap_lower_95"].is_null())
    bootstrap =
        format_entries(", bootstrap {bootstrap_lower_95:.5g} ... {bootstrap_upper_95:.5g}", p);
  report.print("{}{}{}{}{}", format_entries("  {name:<22} {value:>11.6g} {unit:<18} 95 %: ", p),
               interval, bootstrap, p["at_bound"] ? ", at its bound" : "",
               format_entries(" (scene {scene:.6g})\n", p));
}

void fill_report(const std::vector<Parameter>& parameters, const VectorX& start, const Fit& found,
                 Report& report) {
  report["status"] = "ok";
  Json list = Json::array();
  std::string set;
  for (size_t i = 0; i < parameters.size(); ++i) {
    list.push_back(
        json_parameter(parameters[i], start[static_cast<Eigen::Index>(i)], found.parameters[i]));
    print_parameter(list.back(), report);
    set += fmt::format("{}{}={:.8g}", i == 0 ? "" : ",", parameters[i].name,
                       found.parameters[i].value);
  }
  report.print("  --set {}\n", set);
  report["parameters"] = list;
  report["set"] = set;
  Json correlation = Json::array();
  for (Eigen::Index i = 0; i < found.correlation.rows(); ++i) {
    const VectorX row = found.correlation.row(i);
    correlation.push_back(std::vector<double>(row.begin(), row.end()));
  }
  report["correlation"] = correlation;
  report["start_cost"] = found.start_cost;
  report["cost"] = found.cost;
  report["loss_scale"] = found.loss_scale;
  report["evaluations"] = found.evaluations;
  report["linearizations"] = found.linearizations;
}

/// Writes the page with the parameters and the errors over time of these rollouts.
void write_page_of(const IdentifyArguments& arguments, const Rollouts& rollouts, Compared by,
                   const Json& report) {
  const auto& [before, after] = rollouts;
  HtmlPage page("Figures found: " + arguments.scene.file);
  PageTable parameters{{"parameter", "unit", "scene", "found", "95 % from", "to"}, {}};
  for (const Json& p : report["parameters"])
    parameters.rows.push_back({p["name"], p["unit"], number_text(p["scene"]),
                               number_text(p["value"]), number_text(p["lower_95"]),
                               number_text(p["upper_95"])});
  page.table(parameters);
  for (const char* part : {"train", "test"}) {
    if (!report.contains(part)) continue;
    page.heading(fmt::format("{}: {} recordings", part, report[part]["recordings"].get<int>()));
    PageTable scores{{"median", "scene", "found"}, {}};
    for (const auto& [name, value] : report[part]["scene"].items())
      scores.rows.push_back(
          {name, number_text(value), number_text(report[part]["found"].value(name, Json()))});
    page.table(scores);
  }
  for (const Chart& chart : error_charts({{"scene", &before}, {"as found", &after}}, by))
    page.picture_with_file(svg(chart));
  page.heading("Each recording not fitted, as found");
  page.table(prediction_table(after, by));
  write_page(arguments.page, page);
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

/// Finds the parameters and motions that explain the recordings, as one problem on rank 0.
Fit explained_best(IdentifyArguments& arguments, const Experiment& e,
                   const std::vector<Parameter>& parameters, const std::vector<int>& which,
                   tasks::World& world) {
  if (arguments.tasks.is_share())
    throw InputError("--tasks: with --objective explain all recordings are one task");
  const FitOptions &given = arguments.fit, usual;
  if (given.samples != usual.samples || given.refined != usual.refined || given.bootstrap > 0 ||
      given.difference != usual.difference || !given.exact || arguments.loss != "cauchy")
    throw InputError(
        "--objective explain: leave out --samples, --refined, --bootstrap, --difference, "
        "--derivatives and --loss");
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

int identify(IdentifyArguments& arguments, tasks::World& world) {
  arguments.report.begin("identify", arguments.scene.file);
  arguments.fit.exact = arguments.derivatives == "exact";
  const Experiment e = make_experiment(arguments);
  const std::vector<Parameter> parameters = parse_parameters(arguments.parameters, e.scene);
  const Split parts = split(arguments, e);
  const Interrupt interrupt;
  const auto search = arguments.objective == "explain" ? explained_best : predicted_best;
  const Fit found = search(arguments, e, parameters, parts.train, world);
  if (!world.is_root()) return kSuccess;

  Report& report = arguments.report;
  fill_report(parameters, parameter_values(parameters, e.scene), found, report);
  if (found.stopped) return end_early("the best found so far, without intervals or scores", report);
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
  if (!arguments.page.empty()) write_page_of(arguments, shown, by, report.json());
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
  command.add("--objective score|rows|one-step|force|explain", arguments.objective,
              "Minimized: score (default; mean deviations of each recording), rows (squared "
              "deviations at every row), one-step (rows, from every row to the next), force "
              "(unexplained by compare --mode inverse), explain (unexplained by any motion)");
  command.add("--swap", arguments.swap, "Exchange the recordings fitted and scored");
  command.add("--horizon", arguments.horizon,
              "Rows between restarts from the recording; 0: start at its first row only",
              not_negative);
  command.add("--loss cauchy|squares", arguments.loss, "cauchy (default) or squares");
  command.add("--samples", arguments.fit.samples, "Points tried before any is refined",
              range(0, 1'000'000));
  command.add("--refined", arguments.fit.refined, "Points refined", range(1, 1000));
  command.add("--difference", arguments.fit.difference,
              "Last step of the differences, as a share of the range (default 1e-3)",
              range(1e-9, 0.03));
  command.add("--derivatives exact|differences", arguments.derivatives,
              "exact (default: where steps have closed forms) or differences");
  command.add("--bootstrap", arguments.fit.bootstrap, "Refits to recordings drawn anew",
              range(0, 100'000));
  command.add("--report DIR", arguments.page, "Folder for a page with tables and pictures");
  arguments.tasks.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
