#include "counterpoint/engine/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/files/file_format.h"

namespace counterpoint {
namespace {

/// Value of kSofteningColumn of an unfinished step, whose factor is infinite: tables hold finite
/// numbers.
constexpr double kUnfinishedFactor = 0.0;

/// Tolerance of times as a fraction of the step: times may be sums of steps, or rounded to a few
/// digits; a missing row differs by a whole step.
constexpr double kTimeTolerance = 1e-3;
/// Tolerance relative to the time, for short steps late in a run: both times are rounded.
constexpr double kTimeRounding = 4.0 * std::numeric_limits<double>::epsilon();

constexpr int kFormatColumns = 1, kSofteningColumns = 2;

/// Returns the indices of the named columns. @throws InputError if one is missing.
std::vector<int> find_columns(const Table& table, const std::vector<std::string>& names) {
  std::vector<int> indices;
  for (const std::string& name : names) {
    const int index = table.find_column(name);
    if (index < 0) {
      throw InputError(
          fmt::format("{}: no column '{}', which this scene's trajectories have; is it "
                      "the trajectory of another scene?",
                      table.where_columns(), name));
    }
    indices.push_back(index);
  }
  return indices;
}

void refuse_unknown_columns(const Table& table, const Model& model, const CoordinateNames& names) {
  const auto holds = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const std::string& column : table.columns()) {
    const bool other = column == "time" || column == "time_step" || column == kStateHashColumn ||
                       column == kModelHashColumn || column == kOptionsHashColumn ||
                       column == kNextStepColumn || column == kSofteningColumn ||
                       column == kSoftenedTreeColumn || column.starts_with(kMemoryPrefix) ||
                       column.starts_with(kTautPrefix) || column.starts_with(kTautKeptPrefix) ||
                       !format_of_column(column).empty();
    if (!other && !holds(names.q, column) && !holds(names.v, column) && !holds(names.z, column) &&
        !holds(names.force, column) && !is_input_column(model, column)) {
      throw InputError(
          fmt::format("{}: column '{}' is no coordinate of this scene; remove it, or "
                      "give the scene the trajectory was made with",
                      table.where_columns(), column));
    }
  }
}

MatrixX read_block(const Table& table, const std::vector<int>& columns, int rows) {
  MatrixX block(columns.size(), rows);
  for (int row = 0; row < rows; ++row) {
    for (size_t i = 0; i < columns.size(); ++i) block(i, row) = table.value(row, columns[i]);
  }
  return block;
}

void check_quaternions(const Table& table, const Model& model, const MatrixX& q) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const bool floating = body.joint_type == JointType::kFloating;
    if (!floating && body.joint_type != JointType::kSpherical) continue;
    const int first = body.q_index + (floating ? 3 : 0);
    for (int row = 0; row < q.cols(); ++row) {
      const double norm = q.col(row).segment<4>(first).norm();
      if (std::abs(norm - 1.0) > kQuaternionTolerance) {
        throw InputError(fmt::format("{}: quaternion of '{}' has length {:.9g}; expected 1",
                                     table.where(row), model.joint(i - 1).link, norm));
      }
    }
  }
}

/// Counts the rows whose state hash differs. A Table holds doubles, so hashes are compared after
/// rounding to 53 bits.
int count_altered_rows(const Table& table, const Trajectory& trajectory) {
  const int column = table.find_column(kStateHashColumn);
  int altered = 0;
  for (int row = 0; column >= 0 && row < trajectory.num_rows(); ++row) {
    State state{trajectory.time[row], trajectory.q.col(row), trajectory.v.col(row)};
    if (trajectory.z.cols() > 0) state.z = trajectory.z.col(row);
    altered += table.value(row, column) != static_cast<double>(state_hash(state));
  }
  return altered;
}

}  // namespace

namespace {

void add_state_names(const Actuator& actuator, std::vector<std::string>& names) {
  const auto add = [&](bool has, const std::string& what) {
    if (has) names.push_back(actuator.name + "." + what);
  };
  for (int i = 0; i < actuator.delay_samples; ++i) add(true, fmt::format("delayed{}", i));
  add(actuator.delay_samples > 0, "delay_phase");
  add(actuator.keeps_setpoint(), "setpoint");
  add(actuator.lag > 0.0, "lagged");
  add(actuator.integrates, "integral");
  if (!actuator.has_law_state()) return;
  const ActuatorLaw law = actuator.law;
  add(law == ActuatorLaw::kPid, "integral");
  add(law == ActuatorLaw::kDcMotor, "current");
  add(law == ActuatorLaw::kMuscle, "activation");
}

void add_state_names(const Closure& closure, std::vector<std::string>& names) {
  if (!closure.switched) return;
  names.push_back(closure.name + ".attached");
  if (!closure.in_place) return;
  for (const char* part : {"x", "y", "z", "qw", "qx", "qy", "qz"})
    names.push_back(closure.name + ".attached_" + part);
}

}  // namespace

CoordinateNames coordinate_names(const Model& model) {
  CoordinateNames names;
  for (int i = 0; i < model.num_joints(); ++i) {
    const JointType type = model.body(i + 1).joint_type;
    // Single coordinates are named after the joint, poses after the link, as is customary.
    const std::string& owner = joint_nq(type) == 1 ? model.joint(i).name : model.joint(i).link;
    const JointSuffixes suffixes = joint_suffixes(type);
    for (const char* suffix : suffixes.q) names.q.push_back(owner + "." + suffix);
    for (const char* suffix : suffixes.v) names.v.push_back(owner + "." + suffix);
    for (const char* suffix : suffixes.force) names.force.push_back(owner + "." + suffix);
  }
  for (const Actuator& actuator : model.actuators()) add_state_names(actuator, names.z);
  for (const Closure& closure : model.closures()) add_state_names(closure, names.z);
  return names;
}

namespace {

std::vector<Column> trajectory_columns(const Model& model, const InputColumns& inputs) {
  const CoordinateNames names = coordinate_names(model);
  const std::vector<std::string> input_names = inputs.names(model);
  std::vector<Column> columns{"time", "time_step"};
  for (const auto* list : {&names.q, &names.v, &names.z, &names.force, &input_names}) {
    columns.insert(columns.end(), list->begin(), list->end());
  }
  columns.insert(columns.end(), {format_column(), kSofteningColumn, kSoftenedTreeColumn});
  for (const int body : list_pulled_links(model))
    for (const char* prefix : {kTautPrefix, kTautKeptPrefix})
      columns.push_back(prefix + model.joint(body - 1).link);
  columns.emplace_back(kStateHashColumn, CellType::kInteger);
  return columns;
}

}  // namespace

TrajectoryWriter::TrajectoryWriter(const std::filesystem::path& file, const Model& model,
                                   const InputColumns& columns)
    : table_(file, trajectory_columns(model, columns)),
      model_(model),
      columns_(columns),
      pulled_links_(list_pulled_links(model)),
      num_inputs_(model.nv() + static_cast<int>(columns.names(model).size())) {}

void TrajectoryWriter::write_state(const State& state, std::optional<double> time_step) {
  table_.number(state.time);
  time_step ? table_.number(*time_step) : table_.empty();
  for (const double x : state.q) table_.number(x);
  for (const double x : state.v) table_.number(x);
  for (const double x : state.z.size() > 0 ? state.z : model_.default_z()) table_.number(x);
}

void TrajectoryWriter::write_step(const State& state, const Input& input, double time_step,
                                  const Softening& softening,
                                  const std::vector<TautLink>& taut_links) {
  write_state(state, time_step);
  for (const double x : input.applied_force) table_.number(x);
  if (input.applied_force.size() == 0)
    for (int i = 0; i < model_.nv(); ++i) table_.number(0.0);
  for (const double x : columns_.values(model_, input)) table_.number(x);
  table_.empty();  // the format
  table_.number(softening.unfinished() ? kUnfinishedFactor : softening.factor);
  table_.number(softening.tree);
  auto link = taut_links.begin();
  for (const int body : pulled_links_) {
    while (link != taut_links.end() && link->body < body) ++link;
    const bool taut = link != taut_links.end() && link->body == body;
    table_.number(taut ? link->factor : 1.0);
    table_.number(taut ? link->kept : 1.0);
  }
  table_.integer(state_hash(state));
  table_.end_row();
}

void TrajectoryWriter::write_end(const State& state) {
  write_state(state, std::nullopt);
  const int pulled = static_cast<int>(pulled_links_.size());
  for (int i = 0; i < num_inputs_ + kFormatColumns + kSofteningColumns + 2 * pulled; ++i)
    table_.empty();
  table_.integer(state_hash(state));
  table_.end_row();
  table_.finish();
}

namespace {

/// Reads the softening of each step, if the table has it.
std::vector<Softening> read_softening(const Table& table, const Model& model, int steps) {
  std::vector<Softening> out;
  const int factor = table.find_column(kSofteningColumn);
  if (factor < 0) return out;
  const int tree = table.column(kSoftenedTreeColumn);
  for (int row = 0; row < steps; ++row) {
    double f = table.value(row, factor);
    const double t = table.value(row, tree);
    if (f == kUnfinishedFactor) f = std::numeric_limits<double>::infinity();
    if (std::abs(f) < 1.0)
      throw InputError(
          fmt::format("{}: column '{}' is {}; 1 (none), a factor above 1 or below -1, or 0 "
                      "(unfinished) is expected",
                      table.where(row), kSofteningColumn, f));
    if (t != std::floor(t) || t < -1.0 || t >= model.num_trees())
      throw InputError(
          fmt::format("{}: column '{}' is {}; a tree of the scene, 0 ... {}, or -1 is "
                      "expected",
                      table.where(row), kSoftenedTreeColumn, t, model.num_trees() - 1));
    out.push_back({f, static_cast<int>(t)});
  }
  return out;
}

/// Reads the taut links of each step, if the table has them.
std::vector<std::vector<TautLink>> read_taut_links(const Table& table, const Model& model,
                                                   int steps) {
  std::vector<std::vector<TautLink>> out;
  for (int body = 1; body < model.num_bodies(); ++body) {
    const std::string& link = model.joint(body - 1).link;
    const int factor = table.find_column(kTautPrefix + link);
    if (factor < 0) continue;
    const int kept = table.column(kTautKeptPrefix + link);
    out.resize(static_cast<size_t>(steps));
    for (int row = 0; row < steps; ++row) {
      const TautLink taut{body, table.value(row, factor), table.value(row, kept)};
      if (!(taut.kept >= 1.0 && taut.kept <= taut.factor && std::isfinite(taut.factor)))
        throw InputError(fmt::format(
            "{}: columns '{}{}' and '{}{}' are {} and {}; numbers from 1 on are expected, the "
            "second no larger than the first",
            table.where(row), kTautPrefix, link, kTautKeptPrefix, link, taut.factor, taut.kept));
      if (taut.factor > 1.0) out[static_cast<size_t>(row)].push_back(taut);
    }
  }
  return out;
}

}  // namespace

void Trajectory::set_known(const Model& model, int step, Input& input) const {
  columns.set(model, known.col(step), input);
  input.z.resize(0);
  if (z.cols() > 0) input.z = z.col(step);
  input.softening = softening.empty() ? Softening() : softening[static_cast<size_t>(step)];
  input.taut_links.clear();
  if (!taut_links.empty()) input.taut_links = taut_links[static_cast<size_t>(step)];
}

Trajectory read_trajectory(const std::filesystem::path& file, const Model& model,
                           const RowsRead& on_rows) {
  const Table table(file, on_rows);
  const CoordinateNames names = coordinate_names(model);
  refuse_unknown_columns(table, model, names);
  const int rows = table.num_rows();
  if (rows == 0) throw InputError(fmt::format("{}: no rows below the header", table.file()));

  Trajectory trajectory;
  trajectory.file = table.file();
  const int time = table.column("time");
  for (int row = 0; row < rows; ++row) {
    trajectory.time.push_back(table.value(row, time));
    if (row > 0 && trajectory.time[row] <= trajectory.time[row - 1]) {
      throw InputError(
          fmt::format("{}: time {} does not rise", table.where(row), trajectory.time[row]));
    }
  }
  const int time_step = table.find_column("time_step");
  for (int row = 0; time_step >= 0 && row + 1 < rows; ++row) {
    trajectory.time_step.push_back(table.value(row, time_step));
  }
  const auto has_any = [&](const std::vector<std::string>& list) {
    return std::any_of(list.begin(), list.end(),
                       [&](const std::string& name) { return table.find_column(name) >= 0; });
  };
  trajectory.q = read_block(table, find_columns(table, names.q), rows);
  trajectory.v = read_block(table, find_columns(table, names.v), rows);
  if (has_any(names.z)) trajectory.z = read_block(table, find_columns(table, names.z), rows);
  if (has_any(names.force)) {
    trajectory.applied_force = read_block(table, find_columns(table, names.force), rows - 1);
  }
  trajectory.softening = read_softening(table, model, rows - 1);
  trajectory.taut_links = read_taut_links(table, model, rows - 1);
  trajectory.columns = find_input_columns(table, model);
  trajectory.known = read_input_columns(trajectory.columns, table, model, rows - 1);
  check_quaternions(table, model, trajectory.q);
  trajectory.altered_rows = count_altered_rows(table, trajectory);
  trajectory.has_hashes = table.find_column(kStateHashColumn) >= 0;
  return trajectory;
}

std::vector<double> step_lengths(const Trajectory& trajectory, std::optional<double> given,
                                 double scene_step) {
  const bool recorded = !trajectory.time_step.empty();
  std::vector<double> steps =
      recorded ? trajectory.time_step
               : std::vector<double>(trajectory.num_steps(), given.value_or(scene_step));
  for (int k = 0; k < trajectory.num_steps(); ++k) {
    if (recorded && given && *given != steps[k]) {
      throw InputError(
          fmt::format("{}: row {} was computed with a time step of {} s, not the {} s given",
                      trajectory.file, k + 1, steps[k], *given));
    }
    const double interval = trajectory.time[k + 1] - trajectory.time[k];
    const double rounding = kTimeRounding * std::abs(trajectory.time[k + 1]);
    if (!(std::abs(interval - steps[k]) <= kTimeTolerance * steps[k] + rounding)) {
      throw InputError(
          fmt::format("{}: rows {} and {} are {:.9g} s apart, but the time step is {:.9g} s; {}",
                      trajectory.file, k + 1, k + 2, interval, steps[k],
                      recorded ? "a row seems to be missing: compare --mode inverse takes rows "
                                 "further apart than steps"
                               : "give the step the motion was computed with (--timestep); a "
                                 "thinned or measured motion "
                                 "is for compare --mode inverse"));
    }
  }
  return steps;
}

}  // namespace counterpoint
