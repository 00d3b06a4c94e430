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
  std::string map, output, set, page, mode = "rollout";
  std::optional<int> substeps;
  std::optional<double> reach;
  int horizon = 0, shown = 20;
  view::ViewOption view;
  Report report;
};

void fill_report(const Model& model, const std::vector<Prediction>& predictions, Compared by,
                 Report& report) {
  Json recordings = Json::array();
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
  Json medians;
  for (const auto& [key, value] : median_metrics(predictions, by)) medians[key] = value;
  report["median"] = medians;
  report["recordings"] = recordings;
  fmt::print(report.text(), "{} recordings, {} failed\n", predictions.size(), failures);
  for (const auto& [key, value] : medians.items()) {
    fmt::print(report.text(), "  median {} {:.5g}\n", key, value.get<double>());
  }
}

std::vector<const Recording*> pointers(const std::vector<Recording>& recordings) {
  std::vector<const Recording*> out;
  for (const Recording& recording : recordings) out.push_back(&recording);
  return out;
}

/// Reports the residual forces by coordinate, over all recordings.
void report_coordinates(const std::vector<CoordinateMetrics>& coordinates, Report& report) {
  report["coordinates"] = coordinate_list(coordinates);
  for (const CoordinateMetrics& one : coordinates)
    fmt::print(report.text(), "  {}: rms {:.5g}{}\n", one.name, one.rms,
               one.r2 ? fmt::format(", R2 {:.4f}", *one.r2) : "");
}

/// Reports, to the user too, that Ctrl-C left some recordings out. Returns the exit code.
int end_early(size_t done, size_t given, const CompareArguments& arguments, Report& report) {
  const std::string message =
      fmt::format("stopped by Ctrl-C or SIGTERM: {} of {} recordings were compared", done, given);
  report["status"] = "stopped";
  report["message"] = message;
  std::string files;
  if (!arguments.output.empty()) files = "; the rows so far are in " + arguments.output;
  if (done > 0 && !arguments.page.empty()) files += "; the page is in " + arguments.page;
  fmt::print(stderr, "error: {}{}\n", message, files);
  return kFailed;
}

/// Table of the forces, row by row.
class ForceRows {
 public:
  ForceRows(const std::string& file, const Model& model) {
    if (file.empty()) return;
    const CoordinateNames names = coordinate_names(model);
    std::vector<Column> columns{{"recording", CellType::kText}, "time", "contacts"};
    columns.insert(columns.end(), names.force.begin(), names.force.end());
    table_ = std::make_unique<TableWriter>(file, columns);
  }

  void write(const ExplainedRecording& explained) {
    for (size_t k = 0; table_ && k < explained.steps.size(); ++k) {
      table_->text(explained.file);
      table_->number(explained.time[k]);
      table_->number(explained.steps[k].contacts);
      for (const double force : explained.steps[k].force) table_->number(force);
      table_->end_row();
    }
  }

  void finish() {
    if (table_) table_->finish();
  }

 private:
  std::unique_ptr<TableWriter> table_;
};

/// Explains recordings until Ctrl-C; returns the finished ones.
std::vector<ExplainedRecording> explain_all(Explainer& explainer, const ColumnMap& map,
                                            const std::vector<Recording>& recordings,
                                            ForceRows& rows) {
  std::vector<ExplainedRecording> all;
  const Interrupt interrupt;
  Progress progress("explaining", static_cast<int>(recordings.size()));
  for (const Recording& recording : recordings) {
    all.push_back(explain_recording(explainer, map, recording, Interrupt::wanted));
    if (all.back().stopped) {
      all.pop_back();
      break;
    }
    rows.write(all.back());
    progress.update(static_cast<int>(all.size()));
  }
  progress.wipe();
  rows.finish();
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
  report["median"] = medians;
  report["recordings"] = list;
  fmt::print(report.text(), "{} recordings\n", all.size());
  for (const auto& [key, value] : medians.items())
    fmt::print(report.text(), "  median {} {:.5g}\n", key, value.get<double>());
}

int compare_inverse(CompareArguments& arguments) {
  const Scene scene = with_settings(arguments.scene.load(), arguments.set);
  const ColumnMap map = load_column_map(arguments.map, scene.model);
  refuse_sensors(map, "compare");
  if (compared(map) == Compared::kImpacts)
    throw InputError("--mode inverse: an impact takes no time, forces are not to be had");
  Explainer explainer(scene, map, arguments.reach.value_or(scene.options.contact.margin));
  ForceRows rows(arguments.output, scene.model);
  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  report["mode"] = arguments.mode;
  report["status"] = "ok";
  std::vector<Recording> recordings = read_with_notes(arguments.recordings, map, scene);
  const size_t given = recordings.size();
  const std::vector<ExplainedRecording> all = explain_all(explainer, map, recordings, rows);
  recordings.resize(all.size());
  int exit_code = kSuccess;
  if (all.size() < given) exit_code = end_early(all.size(), given, arguments, report);
  const std::vector<CoordinateMetrics> coordinates =
      force_metrics(explainer, scene.model, pointers(recordings), all);
  report_explained(all, report);
  report_coordinates(coordinates, report);
  report.write();
  if (!arguments.page.empty() && !all.empty()) {
    HtmlPage page("Forces behind recordings: " + arguments.scene.file);
    const Chart chart = unexplained_chart(all);
    page.paragraph("What no contact within reach can have given, over the weight.");
    page.picture(svg(chart));
    page.table(coordinate_table(coordinates));
    page.table(explanation_table(all));
    write_page(arguments.page, page, {chart});
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
                             arguments.set.empty() ? "" : ", " + arguments.set));
  PageTable medians{{"median", "value"}, {}};
  for (const auto& [name, value] : median_metrics(predictions, by))
    medians.rows.push_back({name, fmt::format("{:.5g}", value)});
  page.table(medians);
  const std::vector<Chart> charts = error_charts({{"error", &predictions}}, by);
  for (const Chart& chart : charts) page.picture(svg(chart));
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
  write_page(arguments.page, page, charts);
}

int compare(CompareArguments& arguments) {
  arguments.view.check();
  if (arguments.mode == "inverse") {
    if (arguments.view.wanted())
      throw InputError("--view shows predictions; with --mode inverse there are none");
    return compare_inverse(arguments);
  }
  const Scene scene = with_settings(arguments.scene.load(), arguments.set);
  PredictionOptions options;
  options.scene_step = scene.options.time_step;
  options.horizon = arguments.mode == "one-step" ? 1 : arguments.horizon;
  const ColumnMap map = load_column_map(arguments.map, scene.model);
  refuse_sensors(map, "compare");
  options.substeps = arguments.substeps ? arguments.substeps : map.substeps;
  if (options.substeps && *options.substeps < 1) throw InputError("--substeps: expected 1 or more");

  PredictionRows writer(arguments.output, map);
  std::vector<Prediction> predictions;
  std::vector<Recording> recordings = read_with_notes(arguments.recordings, map, scene);
  const size_t given = recordings.size();
  const Interrupt interrupt;
  options.stop = Interrupt::wanted;
  Predictor predictor(scene, map, options);
  Progress progress("comparing", static_cast<int>(given));
  for (const Recording& recording : recordings) {
    predictions.push_back(predictor.predict(recording));
    writer.write(recording, predictions.back());
    if (predictions.back().stopped) break;
    progress.update(static_cast<int>(predictions.size()));
  }
  Interrupt::end();
  progress.wipe();
  if (!predictions.empty() && predictions.back().stopped) predictions.pop_back();
  recordings.resize(predictions.size());
  writer.finish();

  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  report["mode"] = arguments.mode;
  fill_report(scene.model, predictions, compared(map), report);
  report_coordinates(velocity_metrics(map, predictions), report);
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
  auto arguments = std::make_shared<CompareArguments>();
  Command& command = line.add(
      "compare", "Simulate from the first row of recordings; measure the distance to them");
  arguments->scene.add_to(command);
  command.add_option("RECORDING", arguments->recordings, "Recordings (.csv, .h5, .npz, .mcap)")
      .required();
  command
      .add_option("--columns", arguments->map,
                  "Column map (YAML, docs/guide/recordings.md): which column is which coordinate")
      .required();
  command.add_option(
      "--substeps", arguments->substeps,
      "Time steps between two rows; default: the map's, else as the scene's time step");
  command
      .add_option("--mode", arguments->mode,
                  "rollout (default): from the first row; one-step: from every row to the next; "
                  "inverse: forces behind the recorded motion")
      .one_of({"rollout", "one-step", "inverse"});
  command
      .add_option("--horizon", arguments->horizon,
                  "rollout: start anew from the recording every so many rows; 0: never")
      .not_negative();
  command
      .add_option("--reach", arguments->reach,
                  "inverse: contacts up to this gap [m] may push; default: the scene's margin")
      .not_negative();
  command.add_option("--set", arguments->set,
                     "Figures of the scene to change first: KIND[:ELEMENT]=VALUE,... "
                     "(docs/guide/recordings.md)");
  command.add_option("--output", arguments->output, "CSV to write: the deviation at every row");
  command.add_option("--report", arguments->page, "Folder for a page with tables and pictures")
      .type_name("DIR");
  command
      .add_option(
          "--shown", arguments->shown,
          "With --report: of so many recordings, worst first, curves and a replay; default 20")
      .not_negative();
  arguments->view.add_to(command);
  arguments->report.add_to(command);
  command.footer(
      "Example:\n  counterpoint compare data/scenes/cube_toss.yaml toss_005.csv toss_016.csv "
      "--columns data/maps/cube_toss.yaml --output report.csv");
  command.action([arguments] { return compare(*arguments); });
}

}  // namespace counterpoint::apps
