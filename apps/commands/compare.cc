// counterpoint compare: predicts recordings by simulation, and measures the distance to them.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command.h"
#include "counterpoint/engine/io/trajectory.h"
#include "input/scene_arguments.h"
#include "measure/median.h"
#include "recordings/page.h"
#include "recordings/parameters.h"
#include "recordings/prediction.h"
#include "recordings/replays.h"
#include "recordings/unexplained.h"
#include "report/failure.h"
#include "report/progress.h"
#include "report/report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct Arguments {
  SceneArguments scene;
  std::vector<std::string> recordings;
  std::string map, output, set, page, mode = "rollout";
  std::optional<int> substeps;
  std::optional<double> reach;
  int horizon = 0, shown = 20;
  view::ViewOption view;
  Report report;
};

/// One row of the report: the deviation, then recorded and simulated values of the mapped
/// positions.
class RowWriter {
 public:
  RowWriter(const std::string& file, const ColumnMap& map) : map_(map) {
    if (file.empty()) return;
    std::vector<Column> columns{{"recording", CellType::kText}, "time"};
    if (!map.after.empty()) {
      columns[1].name = "contacts";
      columns.insert(columns.end(),
                     {"velocity_error_m_s", "energy_ratio", "recorded_energy_ratio"});
      for (const ColumnMap::Entry& entry : map.after) {
        columns.push_back(entry.name);
        columns.push_back(entry.name + ".recorded");
      }
      table_ = std::make_unique<TableWriter>(file, columns);
      return;
    }
    if (map.free_body >= 0) {
      columns.insert(columns.end(), {"position_error_m", "rotation_error_deg"});
    } else {
      columns.emplace_back("joint_error");
    }
    for (const ColumnMap::Entry& entry : map.entries) {
      if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
      columns.push_back(entry.name);
      columns.push_back(entry.name + ".recorded");
    }
    table_ = std::make_unique<TableWriter>(file, columns);
  }

  void write(const Recording& recording, const Prediction& prediction) {
    if (!table_) return;
    if (prediction.impact) return write_impact(recording, prediction);
    size_t predicted = 0;
    for (int row = 0; row < recording.num_rows(); ++row) {
      const bool start =
          predicted == prediction.time.size() || recording.time[row] != prediction.time[predicted];
      if (start && row > 0) break;  // a step failed
      write_row(recording, row, start ? Deviation() : prediction.deviations[predicted++],
                prediction.q.col(row));
    }
  }

  void finish() {
    if (table_) table_->finish();
  }

 private:
  void write_impact(const Recording& recording, const Prediction& prediction) {
    const ImpactDeviation& impact = *prediction.impact;
    table_->text(recording.file);
    table_->number(impact.contacts);
    for (const double x : {impact.speed, impact.energy_ratio, impact.recorded_energy_ratio})
      table_->number(x);
    for (const ColumnMap::Entry& entry : map_.after) {
      const double recorded = recording.v(entry.index, 1);
      table_->number(recorded + prediction.velocity_error(entry.index, 0));
      table_->number(recorded);
    }
    table_->end_row();
  }

  void write_row(const Recording& recording, int row, const Deviation& deviation,
                 const VectorX& q) {
    table_->text(recording.file);
    table_->number(recording.time[row]);
    if (map_.free_body >= 0) {
      table_->number(deviation.position);
      table_->number(deviation.rotation);
    } else {
      table_->number(deviation.joints);
    }
    for (const ColumnMap::Entry& entry : map_.entries) {
      if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
      table_->number(q[entry.index]);
      table_->number(recording.q(entry.index, row));
    }
    table_->end_row();
  }

  const ColumnMap& map_;
  std::unique_ptr<TableWriter> table_;
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
      for (const auto& [key, value] : figures(prediction, by)) entry[key] = value;
    }
    entry["steps"] = prediction.steps;
    entry["newton_iterations_mean"] = static_cast<double>(prediction.newton_iterations) /
                                      static_cast<double>(std::max(prediction.steps, 1L));
  }
  report["status"] = failures == 0 ? "ok" : "failed";
  report["failures"] = failures;
  Json medians;
  for (const auto& [key, value] : median_figures(predictions, by)) medians[key] = value;
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

/// What is left by coordinate, over all recordings.
void report_coordinates(const std::vector<CoordinateFigures>& coordinates, Report& report) {
  report["coordinates"] = coordinate_list(coordinates);
  for (const CoordinateFigures& one : coordinates)
    fmt::print(report.text(), "  {}: rms {:.5g}{}\n", one.name, one.rms,
               one.r2 ? fmt::format(", R2 {:.4f}", *one.r2) : "");
}

/// Per recording, and the medians.
int compare_inverse(Arguments& arguments) {
  const Scene scene = with_settings(arguments.scene.load(), arguments.set);
  const ColumnMap map = load_column_map(arguments.map, scene.model);
  if (compared(map) == Compared::kImpacts)
    throw InputError("--mode inverse: an impact takes no time, forces are not to be had");
  Explainer explainer(scene, map, arguments.reach.value_or(scene.options.contact.margin));
  const CoordinateNames names = coordinate_names(scene.model);
  std::unique_ptr<TableWriter> table;
  if (!arguments.output.empty()) {
    std::vector<Column> columns{{"recording", CellType::kText}, "time", "contacts"};
    columns.insert(columns.end(), names.force.begin(), names.force.end());
    table = std::make_unique<TableWriter>(arguments.output, columns);
  }
  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  report["mode"] = arguments.mode;
  report["status"] = "ok";
  Json list = Json::array();
  std::vector<ExplainedRecording> all;
  const std::vector<Recording> recordings = read_all(arguments.recordings, map, scene);
  Progress progress("explaining", static_cast<int>(recordings.size()));
  for (const Recording& recording : recordings) {
    const ExplainedRecording& explained =
        all.emplace_back(explain_recording(explainer, map, recording));
    Json& entry = list.emplace_back();
    entry["file"] = explained.file;
    entry["rows"] = explained.rows;
    for (const auto& [name, value] : explained.figures) entry[name] = value;
    for (size_t k = 0; table && k < explained.steps.size(); ++k) {
      table->text(explained.file);
      table->number(explained.time[k]);
      table->number(explained.steps[k].contacts);
      for (const double force : explained.steps[k].force) table->number(force);
      table->end_row();
    }
    progress.update(static_cast<int>(all.size()));
  }
  if (table) table->finish();
  Json medians = Json::object();
  for (size_t i = 0; i < all[0].figures.size(); ++i) {
    std::vector<double> values;
    for (const ExplainedRecording& one : all) values.push_back(one.figures[i].second);
    medians[all[0].figures[i].first] = median(values);
  }
  report["median"] = medians;
  const std::vector<CoordinateFigures> coordinates =
      force_figures(explainer, scene.model, pointers(recordings), all);
  report["recordings"] = list;
  fmt::print(report.text(), "{} recordings\n", all.size());
  for (const auto& [key, value] : medians.items())
    fmt::print(report.text(), "  median {} {:.5g}\n", key, value.get<double>());
  report_coordinates(coordinates, report);
  report.write();
  if (!arguments.page.empty()) {
    HtmlPage page("Forces behind recordings: " + arguments.scene.file);
    const Chart chart = unexplained_chart(all);
    page.paragraph("What no contact within reach can have given, over the weight.");
    page.picture(svg(chart));
    page.table(coordinate_table(coordinates));
    page.table(explanation_table(all));
    write_page(arguments.page, page, {chart});
  }
  return kSuccess;
}

/// The curves of one recording, as a page beside the report, with its replay where one can be had.
/// Links of both.
std::vector<std::pair<std::string, std::string>> write_recording(
    const Arguments& arguments, const Scene& scene, const ColumnMap& map, size_t number,
    const Recording& recording, const Prediction& prediction, size_t index,
    const Replays& replays) {
  const std::filesystem::path folder = arguments.page;
  const std::string name = std::filesystem::path(recording.file).filename().string();
  std::string error;
  for (const auto& [figure, value] : figures(prediction, compared(map)))
    error += fmt::format("{} {} {:.4g}", error.empty() ? ":" : ",", figure, value);
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

void write_page_of(const Arguments& arguments, const Scene& scene, const ColumnMap& map,
                   const std::vector<Recording>& recordings,
                   const std::vector<Prediction>& predictions, const Replays& replays) {
  const Compared by = compared(map);
  make_report_folder(arguments.page);
  HtmlPage page("Recordings predicted: " + arguments.scene.file);
  page.paragraph(fmt::format("{} recordings, mode {}{}.", predictions.size(), arguments.mode,
                             arguments.set.empty() ? "" : ", " + arguments.set));
  Table medians{{"median", "value"}, {}};
  for (const auto& [name, value] : median_figures(predictions, by))
    medians.rows.push_back({name, fmt::format("{:.5g}", value)});
  page.table(medians);
  const std::vector<Chart> charts = error_charts({{"error", &predictions}}, by);
  for (const Chart& chart : charts) page.picture(svg(chart));
  if (by != Compared::kImpacts && arguments.shown > 0) {
    const size_t shown = std::min<size_t>(arguments.shown, predictions.size());
    std::vector<std::pair<std::string, std::string>> links;
    for (size_t i = 0; i < shown; ++i) {
      const size_t index = replays.worst_first()[i];
      for (auto& link : write_recording(arguments, scene, map, i, recordings[index],
                                        predictions[index], index, replays))
        links.push_back(std::move(link));
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

int compare(Arguments& arguments) {
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
  options.substeps = arguments.substeps ? arguments.substeps : map.substeps;
  if (options.substeps && *options.substeps < 1) throw InputError("--substeps: expected 1 or more");

  RowWriter writer(arguments.output, map);
  std::vector<Prediction> predictions;
  const std::vector<Recording> recordings = read_all(arguments.recordings, map, scene);
  Predictor predictor(scene, map, options);
  Progress progress("comparing", static_cast<int>(recordings.size()));
  for (const Recording& recording : recordings) {
    predictions.push_back(predictor.predict(recording));
    writer.write(recording, predictions.back());
    progress.update(static_cast<int>(predictions.size()));
  }
  writer.finish();

  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  report["mode"] = arguments.mode;
  fill_report(scene.model, predictions, compared(map), report);
  report_coordinates(velocity_figures(map, predictions), report);
  report.write();
  const Replays replays(scene, arguments.scene.file, arguments.map, recordings, predictions,
                        compared(map));
  if (arguments.view.wanted()) replays.write_worst(arguments.view.file(), arguments.view.rate());
  if (!arguments.page.empty())
    write_page_of(arguments, scene, map, recordings, predictions, replays);
  int exit_code = kSuccess;
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
  auto arguments = std::make_shared<Arguments>();
  Command& command = line.add(
      "compare", "Simulate from the first row of recordings; measure the distance to them");
  arguments->scene.add_to(command);
  command.add_option("RECORDING", arguments->recordings, "Recordings (.csv, .h5, .npz, .mcap)").required();
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
