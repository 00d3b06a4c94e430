#include "row.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "measure/run.h"
#include "report/total_energy.h"
#include "tasks/archive.h"
#include "variation.h"

namespace counterpoint::apps::sweep {
namespace {

namespace fs = std::filesystem;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Minimum, maximum, mean or end of columns over the states of a motion, including its start and
/// end.
class ColumnWatch {
 public:
  explicit ColumnWatch(const std::vector<RecordedColumn>& columns) : columns_(columns) {}

  void add(const State& state) {
    ++count_;
    values_.resize(columns_.size(), kNaN);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const RecordedColumn& c = columns_[i];
      const double x = c.velocity ? state.v[c.index] : state.q[c.index];
      double& value = values_[i];
      using Of = RecordedColumn::Of;
      if (count_ == 1 || c.of == Of::kEnd)
        value = x;
      else if (c.of == Of::kMin)
        value = std::min(value, x);
      else if (c.of == Of::kMax)
        value = std::max(value, x);
      else
        value += (x - value) / static_cast<double>(count_);
    }
  }
  const std::vector<double>& values() const { return values_; }

 private:
  const std::vector<RecordedColumn>& columns_;
  long count_ = 0;
  std::vector<double> values_;
};

/// Writes a trajectory under a temporary name and renames it when complete. @throws
/// std::runtime_error if it cannot be written: this is a fault of the machine and not of the task,
/// so it ends the run and is not stored in a row.
class TrajectoryFile {
 public:
  TrajectoryFile(const fs::path& file, const Model& model, const InputColumns& columns)
      : file_(file), own_(file) {
    own_ += fmt::format(".{}", getpid());
    fs::create_directories(file.parent_path());
    try {
      writer_ = std::make_unique<TrajectoryWriter>(own_, model, columns);
    } catch (const InputError& error) {
      throw std::runtime_error(error.what());
    }
  }
  ~TrajectoryFile() {
    std::error_code error;
    if (writer_) fs::remove(own_, error);
  }
  TrajectoryFile(const TrajectoryFile&) = delete;
  TrajectoryFile& operator=(const TrajectoryFile&) = delete;
  TrajectoryWriter& writer() { return *writer_; }
  void finish(const State& end) {
    writer_->write_end(end);
    writer_.reset();
    fs::rename(own_, file_);
  }

 private:
  fs::path file_, own_;
  std::unique_ptr<TrajectoryWriter> writer_;
};

Json metrics_of(const Simulator& simulator, const State& start, const RunTally& tally) {
  Json json;
  tally.fill(simulator.state().time - start.time, json);
  json["energy_start_J"] = total_energy(simulator.model(), start);
  json["energy_end_J"] = total_energy(simulator.model(), simulator.state());
  return json;
}

double number_of(const Json& json, const std::string& key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : kNaN;
}

/// Row without results, for a task whose scene could not be created.
Row empty_row(const Study& study, const std::string& reason) {
  Row row;
  row.reason = reason;
  const Model& model = study.scene.model;
  if (study.record.final_state)
    row.state.assign(static_cast<std::size_t>(model.nq() + model.nv()), kNaN);
  row.columns.assign(study.record.columns.size(), kNaN);
  row.metrics.assign(study.record.metrics.size(), kNaN);
  return row;
}

/// Runs a trial on its scene; empty if it was stopped.
std::optional<Row> run(const Study& study, const Trial& trial, Simulator& simulator,
                       const fs::path& file, bool (*stop)()) {
  simulator.options() = trial.options;
  simulator.set_state({0.0, trial.q, trial.v});
  simulator.input() = Input{VectorX::Zero(simulator.model().nv()), {}};
  AppliedInputs inputs(trial.inputs, simulator);
  const State start = simulator.state();
  RunTally tally;
  if (!study.record.metrics.empty()) tally.watch = std::make_unique<RunWatch>(simulator);
  ColumnWatch watch(study.record.columns);
  watch.add(start);
  std::optional<TrajectoryFile> trajectory;
  if (!file.empty()) trajectory.emplace(file, simulator.model(), inputs.columns(simulator.model()));
  std::vector<TautLink> taut_links;
  RunHooks hooks;
  hooks.stop = stop;
  if (trajectory || !study.record.columns.empty())
    hooks.step = [&](const State& before, const Input& input, double h, const State& after,
                     const StepReport& report) {
      watch.add(after);
      if (!trajectory) return;
      find_taut_links(after, taut_links);
      trajectory->writer().write_step(before, input, h, report.softening, taut_links);
    };
  const std::optional<FailedStep> failed = run_simulation(simulator, inputs, hooks, tally);
  if (tally.interrupted) return {};
  if (trajectory) trajectory->finish(simulator.state());
  Row row;
  if (failed) row.reason = failure_message(simulator.model(), *failed);
  row.steps = static_cast<double>(tally.steps);
  row.end_time = simulator.state().time;
  row.state_hash = state_hash(simulator.state());
  if (study.record.final_state) {
    row.state.assign(simulator.state().q.begin(), simulator.state().q.end());
    row.state.insert(row.state.end(), simulator.state().v.begin(), simulator.state().v.end());
  }
  row.columns = watch.values();
  if (study.record.metrics.empty()) return row;
  const Json metrics = metrics_of(simulator, start, tally);
  for (const std::string& name : study.record.metrics)
    row.metrics.push_back(number_of(metrics, name));
  return row;
}

/// Worker of one thread for a study.
class Worker {
 public:
  Worker(const Study& study, fs::path trajectories, bool (*stop)())
      : study_(study), trajectories_(std::move(trajectories)), stop_(stop) {}

  tasks::Outcome run_task(std::int64_t task) {
    try {
      const std::vector<AxisValue> values = values_of(study_, task);
      Simulator& simulator = simulator_at(values);
      Trial trial(study_, *scene_);
      for (std::size_t i = 0; i < values.size(); ++i)
        if (!study_.axes[i].changes_scene()) study_.axes[i].set(values[i], trial);
      trial.finish(draw_of(study_, task));
      const fs::path file =
          study_.record.trajectories ? trajectory_file(trajectories_, task) : fs::path();
      const std::optional<Row> row = run(study_, trial, simulator, file, stop_);
      return row ? tasks::Outcome{tasks::to_bytes(*row), true} : tasks::Outcome{{}, false};
    } catch (const InputError& error) {  // this task only: an invalid value for the scene
      return {tasks::to_bytes(empty_row(study_, error.what())), true};
    }
  }

 private:
  /// Reuses the simulator of the previous task if only start, options or inputs differ.
  Simulator& simulator_at(const std::vector<AxisValue>& values) {
    std::vector<AxisValue> changes;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (study_.axes[i].changes_scene()) changes.push_back(values[i]);
    if (simulator_ && changes == changes_) return *simulator_;
    simulator_.reset();
    scene_ = scene_at(study_, values);
    changes_ = std::move(changes);
    return simulator_.emplace(*scene_);
  }

  const Study& study_;
  fs::path trajectories_;
  bool (*stop_)();
  std::vector<AxisValue> changes_;  ///< values of the axes that change the scene
  std::optional<Scene> scene_;
  std::optional<Simulator> simulator_;
};

}  // namespace

fs::path trajectory_file(const fs::path& folder, std::int64_t task) {
  return folder / fmt::format("{:03d}", task / 1000) / fmt::format("{:06d}.csv", task);
}

tasks::TaskList task_list(const Study& study, const fs::path& trajectories, bool (*stop)()) {
  tasks::TaskList list;
  list.name = "sweep";
  list.count = study.num_tasks();
  list.fingerprint = study.fingerprint;
  list.make_task = [&study, trajectories, stop]() -> tasks::Task {
    return [worker = std::make_shared<Worker>(study, trajectories, stop)](std::int64_t task) {
      return worker->run_task(task);
    };
  };
  return list;
}

void check_metrics(const Study& study) {
  if (study.record.metrics.empty()) return;
  Simulator simulator(study.scene);
  RunTally tally;
  tally.watch = std::make_unique<RunWatch>(simulator);
  const Json json = metrics_of(simulator, simulator.state(), tally);
  std::vector<std::string> names;
  for (const auto& [key, value] : json.items())
    if (value.is_number() && key != "wall_seconds" && key != "realtime_factor" &&
        key.rfind("step_time_", 0) != 0)
      names.push_back(key);
  names.emplace_back("softened_first_time_s");
  names.emplace_back("unfinished_first_time_s");
  for (const std::string& metric : study.record.metrics)
    if (std::find(names.begin(), names.end(), metric) == names.end())
      throw InputError(fmt::format("{}: record.figures: there is no '{}'; expected some of {}",
                                   study.file.string(), metric, fmt::join(names, ", ")));
}

}  // namespace counterpoint::apps::sweep
