// counterpoint compare: predicts recordings by simulation and measures the distance to them.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/engine/trajectory.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "measure/median.h"
#include "recordings/estimation.h"
#include "recordings/page.h"
#include "recordings/prediction_rows.h"
#include "recordings/replays.h"
#include "report/failure.h"
#include "report/progress.h"
#include "report/report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct CompareArguments {
  SceneArguments scene;
  std::vector<std::string> recordings;
  std::string map, output, page, mode = "rollout";
  std::optional<int> substeps;
  std::optional<double> reach;
  int horizon = 0, shown = 20;
  view::ViewOption view;
  Report report;
};

/// Reports the medians over all recordings and the results of each.
void report_recordings(const Json& medians, const Json& recordings, const std::string& failed,
                       Report& report) {
  report["median"] = medians;
  report["recordings"] = recordings;
  report.print("{} recordings{}\n", recordings.size(), failed);
  for (const auto& [key, value] : medians.items())
    report.print("  median {} {:.5g}\n", key, value.get<double>());
}

void report_predictions(const Model& model, const std::vector<Prediction>& predictions, Compared by,
                        Report& report) {
  Json recordings = Json::array(), medians;
  size_t failures = 0;
  for (const Prediction& prediction : predictions) {
    Json& entry = recordings.emplace_back();
    entry["file"] = prediction.file;
    entry["rows"] = prediction.rows;
    entry["status"] = prediction.failure ? "failed" : "ok";
    if (prediction.failure) {
      add_failure(model, *prediction.failure, entry);
      ++failures;
    } else {
      for (const auto& [key, value] : metrics(prediction, by)) entry[key] = value;
    }
    entry["steps"] = prediction.steps;
    entry["newton_iterations_mean"] = static_cast<double>(prediction.newton_iterations) /
                                      static_cast<double>(std::max(prediction.steps, 1L));
  }
  report["status"] = failures == 0 ? "ok" : "failed";
  report["failures"] = failures;
  for (const auto& [key, value] : median_metrics(predictions, by)) medians[key] = value;
  report_recordings(medians, recordings, fmt::format(", {} failed", failures), report);
}

/// Reports the differences by coordinate, or by column of sensors, over all recordings.
void report_coordinates(const char* key, const std::vector<CoordinateMetrics>& coordinates,
                        Report& report) {
  report[key] = coordinate_list(coordinates);
  for (const CoordinateMetrics& one : coordinates)
    report.print("  {}: rms {:.5g}{}\n", one.name, one.rms,
                 one.r2 ? fmt::format(", R2 {:.4f}", *one.r2) : "");
}

/// Reports, to the user too, that Ctrl-C left some recordings out. Returns the exit code.
int end_early(size_t done, size_t given, const CompareArguments& arguments, Report& report) {
  std::string files;
  if (!arguments.output.empty()) files = "; the rows so far are in " + arguments.output;
  if (done > 0 && !arguments.page.empty()) files += "; the page is in " + arguments.page;
  return end_stopped(fmt::format("{} of {} recordings were compared", done, given), files, report);
}

/// Opens the table of forces; null if none is wanted.
std::unique_ptr<TableWriter> open_forces(const std::string& file, const Model& model) {
  if (file.empty()) return nullptr;
  const CoordinateNames names = coordinate_names(model);
  std::vector<Column> columns{{"recording", CellType::kText}, "time", "contacts"};
  columns.insert(columns.end(), names.force.begin(), names.force.end());
  return std::make_unique<TableWriter>(file, columns);
}

void write_forces(const ExplainedRecording& explained, TableWriter& table) {
  for (size_t k = 0; k < explained.steps.size(); ++k) {
    table.text(explained.file);
    table.number(explained.time[k]);
    table.number(explained.steps[k].contacts);
    for (const double force : explained.steps[k].force) table.number(force);
    table.end_row();
  }
}

/// Explains recordings until Ctrl-C; returns the finished ones.
std::vector<ExplainedRecording> explain_all(Explainer& explainer, const ColumnMap& map,
                                            const std::vector<Recording>& recordings,
                                            TableWriter* table) {
  std::vector<ExplainedRecording> all;
  const Interrupt interrupt;
  Progress progress("explaining", static_cast<int>(recordings.size()));
  for (const Recording& recording : recordings) {
    all.push_back(explain_recording(explainer, map, recording, Interrupt::wanted));
    if (all.back().stopped) {
      all.pop_back();
      break;
    }
    if (table != nullptr) write_forces(all.back(), *table);
    progress.update(static_cast<int>(all.size()));
  }
  progress.wipe();
  if (table != nullptr) table->finish();
  return all;
}

/// Reports each recording, and the medians over all.
void report_explained(const std::vector<ExplainedRecording>& all, Report& report) {
  Json list = Json::array(), medians = Json::object();
  for (const ExplainedRecording& explained : all) {
    Json& entry = list.emplace_back();
    entry["file"] = explained.file;
    entry["rows"] = explained.rows;
    for (const auto& [name, value] : explained.metrics) entry[name] = value;
  }
  for (size_t i = 0; !all.empty() && i < all[0].metrics.size(); ++i) {
    std::vector<double> values;
    for (const ExplainedRecording& one : all) values.push_back(one.metrics[i].second);
    medians[all[0].metrics[i].first] = median(values);
  }
  report_recordings(medians, list, "", report);
}

int compare_inverse(CompareArguments& arguments, const Scene& scene, const ColumnMap& map) {
  if (compared(map) == Compared::kImpacts)
    throw InputError("--mode inverse: an impact takes no time, forces are not to be had");
  Explainer explainer(scene, map, arguments.reach.value_or(scene.options.contact.margin));
  const auto table = open_forces(arguments.output, scene.model);
  Report& report = arguments.report;
  report["status"] = "ok";
  std::vector<Recording> recordings = read_with_notes(arguments.recordings, map, scene);
  const size_t given = recordings.size();
  const std::vector<ExplainedRecording> all = explain_all(explainer, map, recordings, table.get());
  int exit_code = kSuccess;
  if (all.size() < given) exit_code = end_early(all.size(), given, arguments, report);
  std::vector<const Recording*> explained;
  for (size_t i = 0; i < all.size(); ++i) explained.push_back(&recordings[i]);
  const std::vector<CoordinateMetrics> coordinates =
      force_metrics(explainer, scene.model, explained, all);
  report_explained(all, report);
  report_coordinates("coordinates", coordinates, report);
  report.write();
  if (!arguments.page.empty() && !all.empty()) {
    HtmlPage page("Forces behind recordings: " + arguments.scene.file);
    page.paragraph("What no contact within reach can have given, over the weight.");
    page.picture_with_file(svg(unexplained_chart(all)));
    page.table(coordinate_table(coordinates));
    page.table(explanation_table(all));
    write_page(arguments.page, page);
  }
  return exit_code;
}

/// Contents of the report page.
struct Compilation {
  const CompareArguments& arguments;
  const Scene& scene;
  const ColumnMap& map;
  const std::vector<Recording>& recordings;
  const std::vector<Prediction>& predictions;
  const Replays& replays;
};

/// Writes the curves of one recording as a page beside the report, and its replay if possible.
/// Returns the links to both.
std::vector<std::pair<std::string, std::string>> write_recording(const Compilation& of,
                                                                 size_t number, size_t index) {
  const auto& [arguments, scene, map, recordings, predictions, replays] = of;
  const Recording& recording = recordings[index];
  const Prediction& prediction = predictions[index];
  const std::filesystem::path folder = arguments.page;
  const std::string name = std::filesystem::path(recording.file).filename().string();
  std::string error;
  for (const auto& [metric, value] : metrics(prediction, compared(map)))
    error += fmt::format("{} {} {:.4g}", error.empty() ? ":" : ",", metric, value);
  const std::string curves = fmt::format("recording{}.html", number);
  const std::string replay = fmt::format("replay{}.html", number);
  HtmlPage page("Recorded and simulated: " + name);
  std::vector<std::pair<std::string, std::string>> links = {{"all recordings", "index.html"}}, out;
  out.emplace_back(name + error, curves);
  if (replays.can_write()) {
    replays.write(index, folder / replay, arguments.view.rate());
    links.emplace_back("the motion, to play; what was recorded is its ghost", replay);
    out.emplace_back(name + ": to play", replay);
  }
  page.links(links);
  page.paragraph(recording.file + error);
  for (const Chart& chart : coordinate_charts(scene.model, recording, prediction, map))
    page.picture(svg(chart));
  write_file(folder / curves, page.text());
  return out;
}

void write_page_of(const Compilation& of) {
  const auto& [arguments, scene, map, recordings, predictions, replays] = of;
  const Compared by = compared(map);
  make_report_folder(arguments.page);
  HtmlPage page("Recordings predicted: " + arguments.scene.file);
  page.paragraph(fmt::format("{} recordings, mode {}{}.", predictions.size(), arguments.mode,
                             arguments.scene.set.empty() ? "" : ", " + arguments.scene.set));
  PageTable medians{{"median", "value"}, {}};
  for (const auto& [name, value] : median_metrics(predictions, by))
    medians.rows.push_back({name, fmt::format("{:.5g}", value)});
  page.table(medians);
  for (const Chart& chart : error_charts({{"error", &predictions}}, by))
    page.picture_with_file(svg(chart));
  if (by != Compared::kImpacts && arguments.shown > 0) {
    const size_t shown = std::min<size_t>(arguments.shown, predictions.size());
    std::vector<std::pair<std::string, std::string>> links;
    for (size_t i = 0; i < shown; ++i) {
      const size_t index = replays.worst_first()[i];
      for (auto& link : write_recording(of, i, index)) links.push_back(std::move(link));
    }
    page.heading("Recorded and simulated, worst first");
    page.paragraph(
        shown < predictions.size()
            ? fmt::format(
                  "Curves of every coordinate over each other, and replays, of the {} worst; "
                  "--shown says of how many.",
                  shown)
            : "Curves of every coordinate over each other, and replays.");
    page.links(links);
    const size_t worst = replays.worst_first()[0];
    page.heading("The worst: " + std::filesystem::path(recordings[worst].file).filename().string());
    for (const Chart& chart :
         coordinate_charts(scene.model, recordings[worst], predictions[worst], map))
      page.picture(svg(chart));
  }
  page.heading("Each recording");
  page.table(prediction_table(predictions, by));
  write_page(arguments.page, page);
}

/// Predicts recordings until Ctrl-C, and leaves only the finished ones in `recordings`.
std::vector<Prediction> predict_all(Predictor& predictor, std::vector<Recording>& recordings,
                                    PredictionRows& writer) {
  std::vector<Prediction> all;
  const Interrupt interrupt;
  Progress progress("comparing", static_cast<int>(recordings.size()));
  for (const Recording& recording : recordings) {
    all.push_back(predictor.predict(recording));
    writer.write(recording, all.back());
    if (all.back().stopped) break;
    progress.update(static_cast<int>(all.size()));
  }
  Interrupt::end();
  progress.wipe();
  if (!all.empty() && all.back().stopped) all.pop_back();
  recordings.resize(all.size());
  writer.finish();
  return all;
}

int compare(CompareArguments& arguments) {
  arguments.view.check();
  const bool inverse = arguments.mode == "inverse";
  if (inverse && arguments.view.wanted())
    throw InputError("--view shows predictions; with --mode inverse there are none");
  const Scene scene = arguments.scene.load();
  const ColumnMap map = load_column_map(arguments.map, scene.model);
  refuse_sensors(map, "compare", !inverse);
  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  report["mode"] = arguments.mode;
  if (inverse) return compare_inverse(arguments, scene, map);
  PredictionOptions options;
  options.scene_step = scene.options.time_step;
  options.horizon = arguments.mode == "one-step" ? 1 : arguments.horizon;
  options.substeps = arguments.substeps ? arguments.substeps : map.substeps;
  if (options.substeps && *options.substeps < 1) throw InputError("--substeps: expected 1 or more");

  PredictionRows writer(arguments.output, map);
  std::vector<Recording> recordings = read_with_notes(arguments.recordings, map, scene);
  const size_t given = recordings.size();
  options.stop = Interrupt::wanted;
  Predictor predictor(scene, map, options);
  const std::vector<Prediction> predictions = predict_all(predictor, recordings, writer);

  report_predictions(scene.model, predictions, compared(map), report);
  report_coordinates("coordinates", velocity_metrics(map, predictions), report);
  if (!map.sensors.empty())
    report_coordinates("sensors", sensor_metrics(scene.model, map, recordings, predictions),
                       report);
  int exit_code = kSuccess;
  if (predictions.size() < given)
    exit_code = end_early(predictions.size(), given, arguments, report);
  report.write();
  if (predictions.empty()) return exit_code;
  const Replays replays(scene, arguments.scene.file, arguments.map, recordings, predictions,
                        compared(map));
  if (arguments.view.wanted()) replays.write_worst(arguments.view.file(), arguments.view.rate());
  if (!arguments.page.empty())
    write_page_of({arguments, scene, map, recordings, predictions, replays});
  for (const Prediction& prediction : predictions) {
    if (!prediction.failure) continue;
    fmt::print(stderr, "error: {}: {}\n", prediction.file,
               failure_message(scene.model, *prediction.failure));
    exit_code = kFailed;
  }
  return exit_code;
}

}  // namespace

void add_compare(CommandLine& line) {
  auto [command, arguments] = line.add<CompareArguments>(
      "compare", "Simulate from the first row of recordings; measure the distance to them",
      "Example:\n  counterpoint compare data/scenes/cube_toss.yaml toss_005.csv toss_016.csv "
      "--columns data/maps/cube_toss.yaml --output report.csv",
      compare);
  arguments.scene.add_to(command);
  command.add("RECORDING", arguments.recordings, "Recordings (.csv, .h5, .npz, .mcap)", required);
  command.add("--columns", arguments.map,
              "Column map (YAML, docs/guide/recordings.md): which column is which coordinate",
              required);
  command.add("--substeps", arguments.substeps,
              "Time steps between two rows; default: the map's, else as the scene's time step");
  command.add("--mode rollout|one-step|inverse", arguments.mode,
              "rollout (default): from the first row; one-step: from every row to the next; "
              "inverse: forces behind the recorded motion");
  command.add("--horizon", arguments.horizon,
              "rollout: start anew from the recording every so many rows; 0: never", not_negative);
  command.add("--reach", arguments.reach,
              "inverse: contacts up to this gap [m] may push; default: the scene's margin",
              not_negative);
  command.add("--output", arguments.output, "CSV to write: the deviation at every row");
  command.add("--report DIR", arguments.page, "Folder for a page with tables and pictures");
  command.add("--shown", arguments.shown,
              "With --report: of so many recordings, worst first, curves and a replay; default 20",
              not_negative);
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
