#include "counterpoint/engine/estimate/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/engine/estimate/sensors/read_sources.h"
#include "counterpoint/engine/estimate/sensors/table_columns.h"
#include "counterpoint/engine/tables.h"

namespace counterpoint::estimation {
namespace {

/// Recordings have few digits: a quaternion may be this far from unit length.
constexpr double kQuaternionTolerance = 1e-3;
/// Tolerance for averaged quaternions: rotations spread over about 40 degrees shorten the mean this
/// much.
constexpr double kAverageTolerance = 0.02;

/// Calls visit(index into q of a quaternion, index into v of its angular velocity) for every
/// floating and spherical joint.
template <class Visit>
void for_each_quaternion(const Model& model, Visit visit) {
  for (const Body& body : model.bodies()) {
    const bool floating = body.joint_type == JointType::kFloating;
    if (body.tree < 0 || (!floating && body.joint_type != JointType::kSpherical)) continue;
    visit(body.q_index + (floating ? 3 : 0), body.v_index + (floating ? 3 : 0));
  }
}

void normalize_quaternions(const Model& model, double tolerance, const std::string& where,
                           Eigen::Ref<VectorX> q) {
  for_each_quaternion(model, [&](int at, int) {
    auto quaternion = q.segment<4>(at);
    const double norm = quaternion.norm();
    if (!(std::abs(norm - 1.0) <= tolerance)) {
      throw InputError(fmt::format("{}: the quaternion has length {:.6g}; expected 1 within {}",
                                   where, norm, tolerance));
    }
    quaternion /= norm;
  });
}

/// Converts recorded velocities to those of the scene: angular ones in body axes, linear ones of
/// floating links in world axes.
void turn_velocities(const Model& model, const ColumnMap& map, const VectorX& q,
                     Eigen::Ref<VectorX> v) {
  for_each_quaternion(model, [&](int at, int v_at) {
    const Quaternion orientation(q[at], q[at + 1], q[at + 2], q[at + 3]);
    if (map.world_angular)
      v.segment<3>(v_at) = orientation.conjugate() * Vector3(v.segment<3>(v_at));
  });
  for (const Body& body : model.bodies()) {
    if (!map.body_linear || body.tree < 0 || body.joint_type != JointType::kFloating) continue;
    const int at = body.q_index + 3;
    const Quaternion orientation(q[at], q[at + 1], q[at + 2], q[at + 3]);
    v.segment<3>(body.v_index) = orientation * Vector3(v.segment<3>(body.v_index));
  }
}

/// Makes angles and quaternions continuous, as averaging and interpolation need it: recorded angles
/// of joints without limits may jump by a turn, and quaternions may change sign, between rows.
/// Angles that already count turns (range above one turn) are left as they are.
void join_turns(const Model& model, MatrixX& q) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const Eigen::Index rows = q.cols();
  for (const int i : circular_positions(model)) {
    if (rows == 0 || q.row(i).maxCoeff() - q.row(i).minCoeff() > 1.001 * kTurn) continue;
    for (Eigen::Index row = 1; row < rows; ++row)
      q(i, row) -= kTurn * std::round((q(i, row) - q(i, row - 1)) / kTurn);
  }
  for_each_quaternion(model, [&](int at, int) {
    for (Eigen::Index row = 1; row < rows; ++row)
      if (q.block<4, 1>(at, row).dot(q.block<4, 1>(at, row - 1)) < 0.0)
        q.block<4, 1>(at, row) *= -1.0;
  });
}

/// Interpolates missing positions linearly between the rows around them.
void fill_missing(const ColumnMap& map, Recording& recording) {
  MatrixX& q = recording.q;
  if (q.allFinite()) return;
  recording.missing = q.array().isNaN().cast<double>();
  const auto rows = q.cols();
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    Eigen::Index last = -1;  // row with a value
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (recording.missing(entry.index, row) != 0.0) continue;
      const double value = q(entry.index, row);
      const double before = last < 0 ? value : q(entry.index, last);
      for (Eigen::Index k = last + 1; k < row; ++k)
        q(entry.index, k) = before + (value - before) * static_cast<double>(k - last) /
                                         static_cast<double>(row - last);
      last = row;
    }
    if (last < 0)
      throw InputError(
          fmt::format("{}: column '{}' holds no number", recording.file, entry.source.column));
    for (Eigen::Index k = last + 1; k < rows; ++k) q(entry.index, k) = q(entry.index, last);
  }
}

/// Converts positions and velocities recorded on a treadmill belt to ground at rest.
void leave_treadmill(const Model& model, const ColumnMap& map, Recording& recording) {
  if (map.treadmill.isZero(0.0)) return;
  for (int row = 0; row < recording.num_rows(); ++row) {
    const double t = recording.time[static_cast<std::size_t>(row)];
    for (const Body& body : model.bodies()) {
      if (body.tree < 0 || body.joint_type != JointType::kFloating) continue;
      recording.q.col(row).segment<3>(body.q_index) -= t * map.treadmill;
      recording.v.col(row).segment<3>(body.v_index) -= map.treadmill;
    }
  }
}

void read_cell(const ColumnMap::Entry& entry, const Table& table, const ColumnMap& map, int row,
               Recording& recording) {
  using Kind = ColumnMap::Entry::Kind;
  MatrixX& block = entry.kind == Kind::kPosition   ? recording.q
                   : entry.kind == Kind::kVelocity ? recording.v
                   : entry.kind == Kind::kForce    ? recording.applied_force
                                                   : recording.inputs;
  const bool acts = entry.kind == Kind::kForce || entry.kind == Kind::kInput;
  const bool missing =
      map.missing_cells && entry.kind == Kind::kPosition && is_missing(entry.source, table, row);
  // A force acts from its row to the next: trajectories have none in the last row.
  if (acts && row + 1 == table.num_rows() && row > 0 && is_missing(entry.source, table, row))
    block(entry.index, row) = block(entry.index, row - 1);
  else
    block(entry.index, row) = missing ? kMissing : evaluate(entry.source, table, row);
}

Recording read_rows(const Table& table, const ColumnMap& map, const Model& model,
                    const VectorX& start_q, const VectorX& start_v) {
  const int rows = table.num_rows();
  Recording recording;
  recording.file = table.file();
  recording.q = start_q.replicate(1, rows);
  recording.v = start_v.replicate(1, rows);
  recording.applied_force = MatrixX::Zero(model.nv(), rows);
  recording.contact_force =
      MatrixX::Constant(3 * static_cast<Eigen::Index>(map.contact_forces.size()), rows, kMissing);
  recording.time = recorded_times(table, map.rate.value_or(0.0), map.time);
  if (!map.inputs.empty())
    recording.inputs = map.input_columns.values(model, Input()).replicate(1, rows);
  for (int row = 0; row < rows; ++row) {
    for (const std::vector<ColumnMap::Entry>* list : {&map.entries, &map.inputs})
      for (const ColumnMap::Entry& entry : *list) read_cell(entry, table, map, row, recording);
    for (std::size_t k = 0; k < map.contact_forces.size(); ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (const ColumnSource& source = map.contact_forces[k].components[axis];
            !source.column.empty() && map.contact_forces[k].source.empty())
          recording.contact_force(static_cast<Eigen::Index>(3 * k + axis), row) =
              evaluate(source, table, row);
  }
  fill_missing(map, recording);
  for (int row = 0; row < rows; ++row) {
    const double tolerance = recording.missing.size() > 0 && recording.missing.col(row).any()
                                 ? kAverageTolerance
                                 : kQuaternionTolerance;
    normalize_quaternions(model, tolerance, table.where(row), recording.q.col(row));
    turn_velocities(model, map, recording.q.col(row), recording.v.col(row));
  }
  if (!map.rate && map.after.empty())
    recording.note =
        settle_time_unit(table, map.time[0].column, map.time_unit_given, recording.time);
  leave_treadmill(model, map, recording);
  read_readings(table, map, "", recording.time, recording.sensors);
  if (map.after.empty()) join_turns(model, recording.q);
  return recording;
}

/// Returns one recording per row that is not skipped.
std::vector<Recording> read_impacts(const Table& table, const ColumnMap& map, const Model& model,
                                    const VectorX& start_q, const VectorX& start_v) {
  const Recording rows = read_rows(table, map, model, start_q, start_v);
  std::vector<Recording> out;
  for (int row = 0; row < rows.num_rows(); ++row) {
    const bool skip = std::any_of(map.skip.begin(), map.skip.end(), [&](const std::string& column) {
      return table.value(row, table.column(column)) != 0.0;
    });
    if (skip) continue;
    Recording& impact = out.emplace_back();
    impact.file = table.where(row);
    impact.time = {0.0, 0.0};
    impact.q = rows.q.col(row).replicate(1, 2);
    impact.v = rows.v.col(row).replicate(1, 2);
    for (const ColumnMap::Entry& entry : map.after)
      impact.v(entry.index, 1) = evaluate(entry.source, table, row);
    impact.applied_force = MatrixX::Zero(model.nv(), 2);
  }
  if (out.empty())
    throw InputError(fmt::format("{}: no impact is left; all {} rows are skipped", table.file(),
                                 table.num_rows()));
  return out;
}

/// Centred moving average over `count` rows; rows without enough neighbours are dropped.
Recording averaged(const Recording& recording, int count, const Model& model) {
  const int rows = recording.num_rows() - count + 1;
  if (rows < 2)
    throw InputError(fmt::format("{}: {} rows; expected {} or more, to average over {}",
                                 recording.file, recording.num_rows(), count + 1, count));
  Recording out = rows_of(recording, count / 2, rows);
  for (int row = 0; row < rows; ++row) {
    out.q.col(row) = recording.q.middleCols(row, count).rowwise().mean();
    out.v.col(row) = recording.v.middleCols(row, count).rowwise().mean();
    out.applied_force.col(row) = recording.applied_force.middleCols(row, count).rowwise().mean();
    out.contact_force.col(row) = recording.contact_force.middleCols(row, count).rowwise().mean();
    if (recording.inputs.cols() > 0)
      out.inputs.col(row) = recording.inputs.middleCols(row, count).rowwise().mean();
    normalize_quaternions(model, kAverageTolerance,
                          fmt::format("{}: mean over {} rows", recording.file, count),
                          out.q.col(row));
  }
  return out;
}

}  // namespace

Recording rows_of(const Recording& whole, int first, int count) {
  const auto columns = [&](const MatrixX& all) {
    return all.cols() == 0 ? all : MatrixX(all.middleCols(first, count));
  };
  Recording out;
  out.file = whole.file;
  out.note = whole.note;
  out.time.assign(whole.time.begin() + first, whole.time.begin() + first + count);
  out.q = columns(whole.q);
  out.v = columns(whole.v);
  out.applied_force = columns(whole.applied_force);
  out.inputs = columns(whole.inputs);
  out.contact_force = columns(whole.contact_force);
  out.missing = columns(whole.missing);
  out.sensors = whole.sensors;
  return out;
}

std::vector<int> circular_positions(const Model& model) {
  std::vector<int> out;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    if (body.joint_type == JointType::kPlanar) out.push_back(body.q_index + 2);
    if (body.joint_type == JointType::kRevolute && std::isinf(joint.lower) &&
        std::isinf(joint.upper))
      out.push_back(body.q_index);
  }
  return out;
}

std::vector<Recording> read_recordings(const std::filesystem::path& file, const ColumnMap& map,
                                       const Model& model, const VectorX& start_q,
                                       const VectorX& start_v) {
  TableOptions options = map.table;
  options.nan_is_empty = map.missing_cells;
  const Table table(file, {}, options);
  if (!map.after.empty()) return read_impacts(table, map, model, start_q, start_v);
  Recording whole = read_rows(table, map, model, start_q, start_v);
  if (map.average > 1) whole = averaged(whole, map.average, model);
  const int rows = whole.num_rows();
  if (rows < 2 * map.pieces)
    throw InputError(fmt::format("{}: {} rows; expected two or more{}", table.file(), rows,
                                 map.pieces > 1 ? " for each piece" : ""));
  if (map.pieces == 1) return {whole};
  std::vector<Recording> out;
  for (int k = 0; k < map.pieces; ++k) {
    const int first = static_cast<int>(static_cast<long>(rows) * k / map.pieces);
    const int last = static_cast<int>(static_cast<long>(rows) * (k + 1) / map.pieces);
    out.push_back(rows_of(whole, first, last - first));
    if (k > 0) out.back().note.clear();
    out.back().file += fmt::format(" from {:.6g} s", out.back().time[0]);
  }
  return out;
}

std::vector<Recording> read_all(const std::vector<std::string>& files, const ColumnMap& map,
                                const Scene& scene) {
  std::vector<Recording> out;
  for (const std::string& file : files)
    for (Recording& one : read_recordings(file, map, scene.model, scene.q, scene.v))
      out.push_back(std::move(one));
  return out;
}

}  // namespace counterpoint::estimation
