#include "inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/trajectory.h"

namespace counterpoint::apps {
namespace {

/// Prefix of the empty column that states the format of a table, which its reader checks.
constexpr const char* kFormatPrefix = "format.";

}  // namespace

InputSchedule::InputSchedule(const std::filesystem::path& file, const Model& model) {
  const Table table(file);
  const CoordinateNames names = coordinate_names(model);
  const auto holds = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  const int time = table.column("time");
  force_ = MatrixX::Zero(model.nv(), table.num_rows());
  for (int row = 0; row < table.num_rows(); ++row) {
    time_.push_back(table.value(row, time));
    if (row > 0 && time_[row] <= time_[row - 1]) {
      throw InputError(fmt::format("{}: time {} does not rise", table.where(row), time_[row]));
    }
  }
  int found = 0;
  for (int column = 0; column < table.num_columns(); ++column) {
    const std::string& name = table.columns()[column];
    const auto it = std::find(names.force.begin(), names.force.end(), name);
    if (it == names.force.end()) {
      if (name == "time" || name == "time_step" || name == kStateHashColumn ||
          name == kSofteningColumn || name == kSoftenedTreeColumn ||
          name.starts_with(kTautPrefix) || name.starts_with(kTautKeptPrefix) ||
          name.starts_with(kFormatPrefix) || holds(names.q, name) || holds(names.v, name) ||
          holds(names.z, name) || name.ends_with(kActuatorForceSuffix) ||
          is_input_column(model, name))
        continue;
      throw InputError(
          fmt::format("{}:1: column '{}' is no applied force and no other input of this "
                      "scene; `counterpoint inspect` lists them",
                      table.file(), name));
    }
    ++found;
    table.column(name);  // refuses a name that several columns have
    for (int row = 0; row < table.num_rows(); ++row) {
      // The last row of a trajectory has empty force cells: no step starts from it.
      const double cell = table.cell(row, column);
      if (!std::isnan(cell) || row + 1 < table.num_rows()) {
        force_(it - names.force.begin(), row) = table.value(row, column);
      }
    }
  }
  columns_ = find_input_columns(table, model);
  InputColumns held = columns_;
  held.prescribed = false;
  num_moved_ = static_cast<int>(columns_.names(model).size() - held.names(model).size());
  known_ = read_input_columns(columns_, table, model, table.num_rows());
  if (found == 0 && columns_.empty()) {
    throw InputError(
        fmt::format("{}:1: no applied force among the columns; expected time and, for "
                    "example, {}",
                    table.file(), names.force.empty() ? "none" : names.force[0]));
  }
}

void InputSchedule::apply(const Model& model, double time, double slack, Input& input) {
  while (row_ + 1 < static_cast<int>(time_.size()) && time_[row_ + 1] <= time + slack) ++row_;
  if (row_ < 0) return;
  input.applied_force += force_.col(row_);
  if (!columns_.empty()) columns_.set(model, values_at(time, slack), input);
}

/// Returns the values at a time [s] within the present row: those of prescribed joints, the last
/// ones, lie on a line to the next row.
const VectorX& InputSchedule::values_at(double time, double slack) {
  values_ = known_.col(row_);
  const auto row = static_cast<size_t>(row_);
  if (num_moved_ == 0 || row + 1 == time_.size() || time <= time_[row] + slack) return values_;
  const double share = (time - time_[row]) / (time_[row + 1] - time_[row]);
  values_.tail(num_moved_) += share * (known_.col(row_ + 1) - known_.col(row_)).tail(num_moved_);
  return values_;
}

double InputSchedule::next_change(double time, double slack) const {
  const auto next = std::upper_bound(time_.begin(), time_.end(), time + slack);
  return next == time_.end() ? std::numeric_limits<double>::infinity() : *next;
}

RandomForces::RandomForces(const Model& model, double scale, double wrench_scale,
                           std::uint64_t seed)
    : amplitude_(VectorX::Zero(model.nv())), force_(VectorX::Zero(model.nv())), generator_(seed) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    double mass = 0.0;
    for (int k = i; k < body.subtree_end; ++k) mass += model.body(k).inertia.mass;
    const double weight = kStandardGravity * mass;
    for (int k = 0; k < joint_nv(body.joint_type); ++k) {
      const bool translation = body.joint_type == JointType::kPrismatic ||
                               (body.joint_type == JointType::kFloating && k < 3) ||
                               (body.joint_type == JointType::kPlanar && k < 2);
      const double load = joint.prescribed ? 0.0 : weight * (translation ? 1.0 : kLever);
      amplitude_[body.v_index + k] =
          joint.actuated ? scale * std::min(joint.effort_limit, load) : wrench_scale * load;
    }
  }
}

void RandomForces::draw() {
  for (int i = 0; i < force_.size(); ++i) {
    // Maps 53 random bits to [-1, 1): the distributions of the standard differ between libraries.
    const double unit = static_cast<double>(generator_() >> 11) * 0x1p-52 - 1.0;
    force_[i] = amplitude_[i] * unit;
  }
}

void RandomForces::add_to(double time, double slack, VectorX& force) {
  const long period = static_cast<long>(std::floor((time + slack) / kHold));
  for (; held_ < period; ++held_) draw();
  force += force_;
}

double RandomForces::next_change(double time, double slack) const {
  if (amplitude_.isZero(0.0)) return std::numeric_limits<double>::infinity();
  return (std::floor((time + slack) / kHold) + 1.0) * kHold;
}

}  // namespace counterpoint::apps
