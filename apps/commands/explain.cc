// counterpoint explain: estimates the motions behind noisy recordings, and their forces.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "live/search_view.h"
#include "recordings/estimation.h"
#include "recordings/motion_follow.h"
#include "recordings/motion_metrics.h"
#include "recordings/motion_page.h"
#include "recordings/motion_tables.h"
#include "report/progress.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

struct ExplainArguments {
  SceneArguments scene;
  std::vector<std::string> recordings, sources;
  std::string map, page, errors;
  FollowedFiles files;  ///< tables to write; with --follow the recording too
  std::optional<double> from, to;
  int threads = 0;
  bool follow = false, live = false;
  FollowOptions following;
  Report report;
};

/// Returns the rows between --from and --to, with slack because times are rounded sums of steps.
Recording between(const Recording& whole, const ExplainArguments& arguments) {
  const std::vector<double>& time = whole.time;
  const auto slack = [](double t) { return 1e-9 * (1.0 + std::abs(t)); };
  auto begin = time.begin(), end = time.end();
  if (const auto& from = arguments.from)
    begin = std::lower_bound(time.begin(), time.end(), *from - slack(*from));
  if (const auto& to = arguments.to)
    end = std::upper_bound(time.begin(), time.end(), *to + slack(*to));
  if (begin >= end)
    throw InputError(
        fmt::format("--from, --to: no row of {} is left, which goes from {:.6g} to "
                    "{:.6g} s",
                    whole.file, time.front(), time.back()));
  return rows_of(whole, static_cast<int>(begin - time.begin()), static_cast<int>(end - begin));
}

/// Files of the column map's sources, by name.
std::map<std::string, std::string> source_files(const std::vector<std::string>& arguments) {
  std::map<std::string, std::string> out;
  for (const std::string& one : arguments) {
    const auto [name, file] = named_value("--source", one, "NAME=FILE");
    if (!out.emplace(name, file).second)
      throw InputError(fmt::format("--source: '{}' is given twice", name));
  }
  return out;
}

/// Reads the recordings and the readings in other files, and selects the rows between --from and
/// --to.
std::vector<Recording> read_recorded(const ExplainArguments& arguments, const ColumnMap& map,
                                     const Scene& scene) {
  std::vector<Recording> out = read_with_notes(arguments.recordings, map, scene);
  if (out.size() > 1 && !map.sources.empty())
    throw InputError(
        "explain: the column map has 'sources', whose files go with one recording; "
        "explain the recordings one by one");
  const std::map<std::string, std::string> files = source_files(arguments.sources);
  for (Recording& recording : out) {
    read_sources(files, map, recording);
    recording = between(recording, arguments);
  }
  return out;
}

MotionEstimateOptions estimate_options(const ExplainArguments& arguments, const ColumnMap& map) {
  MotionEstimateOptions options;
  options.threads = arguments.threads;
  for (const ColumnMap::ContactForce& force : map.contact_forces)
    options.sums.push_back({force.name, force.bodies});
  if (arguments.errors == "white") options.errors = RecordingErrors::kWhite;
  if (arguments.errors == "slow") options.errors = RecordingErrors::kSlow;
  return options;
}

/// Makes an estimate show the motions that it goes through in a page, which it returns.
std::unique_ptr<live::SearchView> watch_search(const ExplainArguments& arguments,
                                               const Scene& scene, MotionEstimateOptions& options) {
  auto view = live::open_search(
      scene, arguments.scene.file,
      {{{"cost", "1"}, {"residuals over their deviation", "1"}, {"smoothing", "m"}}, true},
      Interrupt::wanted);
  options.watch = [&view = *view, step = 0](const MotionIterate& at) mutable {
    const bool recorded = std::isinf(at.cost);
    const double smoothing = at.options.contact.smoothing;
    view.add(step, {at.cost, at.cost_ratio, smoothing},
             fmt::format("Newton step {}, contacts smoothed over {:.2g} m", step, smoothing));
    if (recorded || view.due())
      view.show(step, recorded ? "recorded" : fmt::format("step {}, cost {:.4g}", step, at.cost),
                at.start, at.options, at.q);
    ++step;
  };
  return view;
}

/// Shows the motion that was found, and how the search ended.
void show_end(const Scene& scene, const MotionEstimate& found, live::SearchView& view) {
  SimulationOptions options = scene.options;
  options.time_step = found.time[1] - found.time[0];
  options.contact.smoothing = found.smoothing;
  std::vector<VectorX> q;
  for (const auto& column : found.q.colwise())
    if (column.allFinite()) q.emplace_back(column);
  if (q.empty()) return view.end("stopped");
  view.show(found.newton_steps, "result", found.time.front(), options, q);
  view.end(fmt::format("{}: {} Newton steps", found.stopped ? "stopped" : "explained",
                       found.newton_steps));
}

/// Estimates motions until Ctrl-C. The last one may be stopped early, with the best motion found so
/// far.
std::vector<MotionEstimate> estimate_all(const ExplainArguments& arguments, const Scene& scene,
                                         const ColumnMap& map,
                                         const std::vector<Recording>& recordings) {
  std::vector<MotionEstimate> all;
  const Interrupt interrupt;
  Progress progress(
      "explaining " + (recordings.size() == 1 ? recordings[0].file
                                              : fmt::format("{} recordings", recordings.size())),
      1);
  MotionEstimateOptions options = estimate_options(arguments, map);
  std::unique_ptr<live::SearchView> view;
  if (arguments.live) view = watch_search(arguments, scene, options);
  options.stop = [&] {
    progress.show_time();
    if (view && view->stop_wanted()) Interrupt::want();
    if (!Interrupt::wanted()) return false;
    Interrupt::end();  // forces and deviations still take time: signals now end the program
    return true;
  };
  for (const Recording& recording : recordings) {
    all.push_back(estimate_motion(scene, map, recording, options));
    if (all.back().stopped || Interrupt::wanted()) break;
  }
  progress.wipe();
  if (view) show_end(scene, all.back(), *view);
  return all;
}

/// Writes the requested tables and returns their file names.
std::vector<std::string> write_tables(const ExplainArguments& arguments,
                                      const ExplainedMotions& motions, std::size_t given) {
  std::vector<std::string> files;
  for (std::size_t i = 0; !arguments.files.output.empty() && i < motions.estimates.size(); ++i) {
    files.push_back(numbered_file(arguments.files.output, i, given));
    write_motion_table(files.back(), motions.scene.model, motions.estimates[i]);
  }
  if (!arguments.files.contacts.empty()) {
    write_contact_table(arguments.files.contacts, motions);
    files.push_back(arguments.files.contacts);
  }
  if (!arguments.files.forces.empty()) {
    write_force_table(arguments.files.forces, motions);
    files.push_back(arguments.files.forces);
  }
  return files;
}

/// Writes the report and prints the results. Returns kSuccess if every estimate can be
/// trusted.
int tell(const ExplainedMotions& motions, const std::vector<ExplainedMetrics>& metrics,
         Report& report) {
  const Model& model = motions.scene.model;
  int exit_code = kSuccess;
  Json list = Json::array();
  for (std::size_t i = 0; i < motions.estimates.size(); ++i) {
    const MotionEstimate& estimate = motions.estimates[i];
    list.push_back(motion_entry(model, estimate, metrics[i]));
    report.print("{}", motion_text(model, estimate, metrics[i]));
    const std::string complaint = motion_complaint(estimate, metrics[i]);
    if (complaint.empty()) continue;
    std::fflush(report.text());
    fmt::print(stderr, "error: {}: {}\n", estimate.file, complaint);
    exit_code = kFailed;
  }
  report["status"] = exit_code == kSuccess ? "ok" : "doubtful";
  report["recordings"] = list;
  return exit_code;
}

/// After Ctrl-C: reports the results so far, to the user too. Returns the exit code.
int end_early(const ExplainedMotions& motions, std::size_t given,
              const std::vector<std::string>& files, Report& report) {
  const MotionEstimate& last = motions.estimates.back();
  std::string so_far = fmt::format("{} of {} recordings were explained",
                                   motions.estimates.size() - (last.stopped ? 1 : 0), given);
  if (last.stopped)
    so_far += fmt::format(
        "; of {} the best motion found so far is told (contacts smoothed over {:.2g} m)", last.file,
        last.smoothing);
  return end_stopped(
      so_far, files.empty() ? "" : fmt::format("; tables: {}", fmt::join(files, ", ")), report);
}

/// Rejects option combinations that --follow does not support.
void check_follow(const ExplainArguments& arguments) {
  if (arguments.recordings.size() != 1) throw InputError("--follow: one recording is expected");
  const std::string& file = arguments.recordings.front();
  if (file != "-" && !file.ends_with(".csv"))
    throw InputError(file + ": --follow reads a CSV file that grows, or '-', standard input");
  if (arguments.live)
    throw InputError("--follow, --live: the page shows whole recordings; leave one out");
  if (!arguments.page.empty())
    throw InputError("--follow, --report: a page needs the whole recording; leave one out");
  if (arguments.from || arguments.to)
    throw InputError("--follow: --from and --to are for whole recordings");
  for (const std::string& table :
       {arguments.files.output, arguments.files.contacts, arguments.files.forces})
    if (!table.empty() && !table.ends_with(".csv"))
      throw InputError(table + ": --follow writes CSV tables, row by row");
}

int follow(ExplainArguments& arguments, const Scene& scene, const ColumnMap& map) {
  check_follow(arguments);
  if (map.pieces > 1 || map.average > 1)
    throw InputError(arguments.map +
                     ": 'pieces' and 'average' need the whole recording, not --follow");
  const MotionEstimateOptions whole = estimate_options(arguments, map);
  FollowOptions& options = arguments.following;
  options.threads = whole.threads;
  options.sums = whole.sums;
  options.errors = whole.errors;
  arguments.files.recording = arguments.recordings.front();
  Report& report = arguments.report;
  report.begin("explain", arguments.scene.file);
  const FollowedMetrics metrics = follow_motion(arguments.files, scene, map, options);
  if (metrics.told == 0)
    throw InputError(fmt::format("{}: {} rows; {} or more are expected to explain a motion",
                                 arguments.recordings.front(), metrics.rows, kLeastRows));
  report["status"] = metrics.stopped ? "stopped" : "ok";
  report["rows"] = metrics.told;
  report["errors"] = recording_errors_name(metrics.errors);
  report["unexplained"] = {{"mean", metrics.unexplained_mean}, {"max", metrics.unexplained_max}};
  report.print(
      "{} rows explained as they came ({} errors); {:.2g} of the weight not explained in "
      "the mean, at most {:.2g}{}\n",
      metrics.told, recording_errors_name(metrics.errors), metrics.unexplained_mean,
      metrics.unexplained_max, metrics.stopped ? "; stopped by Ctrl-C" : "");
  report.write();
  return kSuccess;
}

int explain(ExplainArguments& arguments) {
  const Scene scene = arguments.scene.load();
  ColumnMap map = load_column_map(arguments.map, scene.model);
  map.missing_cells = true;
  if (!map.after.empty())
    throw InputError(
        "explain: an impact takes no time, forces are not to be had; the column map "
        "has 'after'");
  if (arguments.follow) return follow(arguments, scene, map);
  std::vector<Recording> recordings = read_recorded(arguments, map, scene);
  const std::size_t given = recordings.size();
  const std::vector<MotionEstimate> estimates = estimate_all(arguments, scene, map, recordings);
  recordings.resize(estimates.size());
  const ExplainedMotions motions{scene, map, recordings, estimates};
  std::vector<ExplainedMetrics> metrics;
  for (std::size_t i = 0; i < estimates.size(); ++i)
    metrics.push_back(explained_metrics(scene, map, recordings[i], estimates[i]));

  Report& report = arguments.report;
  report.begin("explain", arguments.scene.file);
  const std::vector<std::string> files = write_tables(arguments, motions, given);
  if (!arguments.page.empty())
    write_motion_page(arguments.page,
                      {arguments.scene.file, arguments.map, arguments.scene.package_folders()},
                      motions, metrics);
  int exit_code = tell(motions, metrics, report);
  if (estimates.size() < given || estimates.back().stopped)
    exit_code = end_early(motions, given, files, report);
  report.write();
  return exit_code;
}

}  // namespace

void add_explain(CommandLine& line) {
  auto [command, arguments] = line.add<ExplainArguments>(
      "explain", "Estimate the motion behind a noisy recording and all its forces",
      "Example:\n  counterpoint explain humanoid.yaml walk.csv --columns walk_map.yaml --from 1 "
      "--to 4 --forces forces.csv --report walk",
      explain);
  arguments.scene.add_to(command);
  command.add("RECORDING", arguments.recordings, "Recordings (.csv, .trc, .c3d, .h5, .npz, .mcap)",
              required);
  command.add("--columns", arguments.map,
              "Column map (YAML, docs/guide/recordings.md): which column is which coordinate",
              required);
  command.add("--source", arguments.sources,
              "NAME=FILE: file of one of the column map's 'sources'; may be given again");
  command.add("--output", arguments.files.output,
              "Table to write: the motion, a trajectory; of several recordings one each, numbered");
  command.add("--contacts", arguments.files.contacts,
              "Table to write: force, centre of pressure and slip of each pair of shapes");
  command.add("--forces", arguments.files.forces,
              "Table to write: forces of joints, sums of contact forces, standard deviations");
  command.add("--report DIR", arguments.page, "Folder for a page with charts and a replay");
  command.add("--from", arguments.from, "Time of the first row used [s]");
  command.add("--to", arguments.to, "Time of the last row used [s]");
  command.add("--errors white|slow", arguments.errors,
              "Errors of recorded positions: white (new in every row: encoders), slow (markers on "
              "skin, a model that does not fit); default: found from the recording");
  command.add("--follow", arguments.follow,
              "Explain a CSV file that grows, or '-', standard input, row by row; until Ctrl-C or "
              "the end of the input");
  command.add("--window", arguments.following.window, "With --follow: rows explained together",
              seldom);
  command.add("--lag", arguments.following.lag,
              "With --follow: a row is told once so many rows have followed it", seldom);
  command.add("--idle", arguments.files.idle,
              "With --follow: a file that has not grown for so long has ended [s]; default 5",
              not_negative, seldom);
  command.add(
      "--live", arguments.live,
      "Serve a page that shows the estimate's steps, and can end it; the address is printed");
  command.add("--threads", arguments.threads, "Threads; default: one a core", not_negative);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
