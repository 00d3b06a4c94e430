// counterpoint compare: simulates from the first row of recordings, and measures the distance to
// them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "command.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "failure.h"
#include "progress.h"
#include "recording.h"
#include "report.h"
#include "scene_arguments.h"

namespace counterpoint::apps {
namespace {

struct Arguments {
  SceneArguments scene;
  std::vector<std::string> recordings;
  std::string map, output;
  std::optional<int> substeps;
  Report report;
};

/// Distance between simulation and recording at one row. Either a pose is compared, or joints are.
struct Deviation {
  double position = 0.0;  ///< |p - p_recorded| [m]
  double rotation = 0.0;  ///< relative rotation angle [degrees]
  double joints = 0.0;    ///< mean of |q - q_recorded| over the mapped joints [rad or m]
};

struct Comparison {
  std::string file;
  int rows = 0;
  Deviation mean, end;  ///< over the rows after the first; at the last row
  long steps = 0, newton_iterations = 0;
  std::optional<FailedStep> failure;
};

Deviation deviation(const Model& model, const ColumnMap& map, const VectorX& q,
                    const VectorX& recorded) {
  Deviation result;
  if (map.free_body >= 0) {
    const int i = model.body(map.free_body).q_index;
    result.position = (q.segment<3>(i) - recorded.segment<3>(i)).norm();
    const Quaternion a(q[i + 3], q[i + 4], q[i + 5], q[i + 6]);
    const Quaternion b(recorded[i + 3], recorded[i + 4], recorded[i + 5], recorded[i + 6]);
    result.rotation =
        quaternion_log((a.conjugate() * b).normalized()).norm() * 180.0 / std::numbers::pi;
    return result;
  }
  int joints = 0;
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    result.joints += std::abs(q[entry.index] - recorded[entry.index]);
    ++joints;
  }
  result.joints /= std::max(joints, 1);
  return result;
}

/// One row of the report: the deviation, then recorded and simulated values of the mapped
/// positions.
class RowWriter {
 public:
  RowWriter(const std::string& file, const ColumnMap& map) : map_(map) {
    if (file.empty()) return;
    std::vector<std::string> columns{"recording", "time"};
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
    csv_ = std::make_unique<CsvWriter>(file, columns);
  }

  void write(const Recording& recording, int row, const Deviation& deviation, const VectorX& q) {
    if (!csv_) return;
    csv_->text(recording.file);
    csv_->number(recording.time[row]);
    if (map_.free_body >= 0) {
      csv_->number(deviation.position);
      csv_->number(deviation.rotation);
    } else {
      csv_->number(deviation.joints);
    }
    for (const ColumnMap::Entry& entry : map_.entries) {
      if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
      csv_->number(q[entry.index]);
      csv_->number(recording.q(entry.index, row));
    }
    csv_->end_row();
  }

  void finish() {
    if (csv_) csv_->flush();
  }

 private:
  const ColumnMap& map_;
  std::unique_ptr<CsvWriter> csv_;
};

State first_state(const Model& model, const ColumnMap& map, const Recording& recording) {
  State state{recording.time[0], recording.q.col(0), recording.v.col(0)};
  if (!map.backward_difference) return state;
  const double interval = recording.time[1] - recording.time[0];
  for (const Body& body : model.bodies()) {
    if (body.tree < 0 || body.joint_type != JointType::kFloating) continue;
    state.v.segment<3>(body.v_index) += 0.5 * interval * model.gravity();
  }
  return state;
}

Comparison compare_one(Simulator& simulator, const ColumnMap& map, const Recording& recording,
                       std::optional<int> given_substeps, double scene_step, RowWriter& writer) {
  const Model& model = simulator.model();
  Comparison result;
  result.file = recording.file;
  result.rows = recording.num_rows();
  simulator.set_state(first_state(model, map, recording));
  writer.write(recording, 0, {}, simulator.state().q);
  for (int row = 1; row < recording.num_rows(); ++row) {
    const double interval =
        map.rate ? 1.0 / *map.rate : recording.time[row] - recording.time[row - 1];
    const int substeps =
        given_substeps.value_or(std::max(1, static_cast<int>(std::lround(interval / scene_step))));
    simulator.options().time_step = interval / substeps;
    simulator.input().applied_force = recording.applied_force.col(row - 1);
    for (int k = 0; k < substeps; ++k) {
      const StepReport step = simulator.step();
      result.newton_iterations += step.newton_iterations;
      if (!step.succeeded()) result.failure = {result.steps, simulator.state().time, step};
      ++result.steps;
      if (result.failure) return result;
    }
    result.end = deviation(model, map, simulator.state().q, recording.q.col(row));
    writer.write(recording, row, result.end, simulator.state().q);
    result.mean.position += result.end.position;
    result.mean.rotation += result.end.rotation;
    result.mean.joints += result.end.joints;
  }
  const double compared = recording.num_rows() - 1;
  result.mean.position /= compared;
  result.mean.rotation /= compared;
  result.mean.joints /= compared;
  return result;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

/// The figures of a comparison under their names in the report.
std::vector<std::pair<const char*, double>> figures(const Comparison& c, bool pose) {
  if (!pose) return {{"joint_error_mean", c.mean.joints}, {"joint_error_end", c.end.joints}};
  return {{"position_error_mean_m", c.mean.position},
          {"rotation_error_mean_deg", c.mean.rotation},
          {"position_error_end_m", c.end.position},
          {"rotation_error_end_deg", c.end.rotation}};
}

void fill_report(const Model& model, const std::vector<Comparison>& comparisons, bool pose,
                 Report& report) {
  Json recordings = Json::array();
  std::vector<Comparison> good;
  for (const Comparison& comparison : comparisons) {
    Json& entry = recordings.emplace_back();
    entry["file"] = comparison.file;
    entry["rows"] = comparison.rows;
    entry["status"] = comparison.failure ? "failed" : "ok";
    if (comparison.failure) {
      add_failure(model, *comparison.failure, entry);
    } else {
      for (const auto& [key, value] : figures(comparison, pose)) entry[key] = value;
      good.push_back(comparison);
    }
    entry["steps"] = comparison.steps;
    entry["newton_iterations_mean"] = static_cast<double>(comparison.newton_iterations) /
                                      static_cast<double>(std::max(comparison.steps, 1L));
  }
  report["status"] = good.size() == comparisons.size() ? "ok" : "failed";
  report["failures"] = comparisons.size() - good.size();
  Json medians;
  for (size_t i = 0; !good.empty() && i < figures(good[0], pose).size(); ++i) {
    std::vector<double> values;
    for (const Comparison& comparison : good) values.push_back(figures(comparison, pose)[i].second);
    medians[figures(good[0], pose)[i].first] = median(values);
  }
  report["median"] = medians;
  report["recordings"] = recordings;
  fmt::print(report.text(), "{} recordings, {} failed\n", comparisons.size(),
             comparisons.size() - good.size());
  for (const auto& [key, value] : medians.items()) {
    fmt::print(report.text(), "  median {} {:.5g}\n", key, value.get<double>());
  }
}

int compare(Arguments& arguments) {
  Scene scene = arguments.scene.load();
  const VectorX start_q = scene.q;
  const VectorX start_v = scene.v;
  const double scene_step = scene.options.time_step;
  Simulator simulator(std::move(scene));
  const ColumnMap map = load_column_map(arguments.map, simulator.model());
  const std::optional<int> substeps = arguments.substeps ? arguments.substeps : map.substeps;
  if (substeps && *substeps < 1) throw InputError("--substeps: expected 1 or more");

  RowWriter writer(arguments.output, map);
  std::vector<Comparison> comparisons;
  Progress progress("comparing", static_cast<int>(arguments.recordings.size()));
  for (const std::string& file : arguments.recordings) {
    const Recording recording = read_recording(file, map, simulator.model(), start_q, start_v);
    comparisons.push_back(compare_one(simulator, map, recording, substeps, scene_step, writer));
    progress.update(static_cast<int>(comparisons.size()));
  }
  writer.finish();

  Report& report = arguments.report;
  report.begin("compare", arguments.scene.file);
  fill_report(simulator.model(), comparisons, map.free_body >= 0, report);
  report.write();
  int exit_code = kSuccess;
  for (const Comparison& comparison : comparisons) {
    if (!comparison.failure) continue;
    fmt::print(stderr, "failed: {}: {}\n", comparison.file,
               failure_message(simulator.model(), *comparison.failure));
    exit_code = kFailed;
  }
  return exit_code;
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "compare", "Simulate from the first row of recordings; measure the distance to them");
  arguments->scene.add_to(command);
  command.add_option("RECORDING", arguments->recordings, "Recordings (CSV)")->required();
  command
      .add_option("--columns", arguments->map,
                  "Column map (YAML, docs/recordings.md): which column is which coordinate")
      ->required();
  command.add_option(
      "--substeps", arguments->substeps,
      "Time steps between two rows; default: the map's, else as the scene's time step");
  command.add_option("--output", arguments->output, "CSV to write: the deviation at every row");
  arguments->report.add_to(command);
  command.footer(
      "Example:\n  counterpoint compare data/scenes/cube_toss.yaml toss_005.csv toss_016.csv "
      "--columns data/maps/cube_toss.yaml --output report.csv");
  command.callback([arguments, &action] { action = [arguments] { return compare(*arguments); }; });
}

}  // namespace counterpoint::apps
