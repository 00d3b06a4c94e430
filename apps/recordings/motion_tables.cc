#include "recordings/motion_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/trajectory.h"
#include "recordings/motion_metrics.h"

namespace counterpoint::apps {
namespace {

/// Pairs with a smaller force are left out [weights of the scene].
constexpr double kLeastForce = 1e-6;

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

void write_number(double value, TableWriter& table) {
  std::isfinite(value) ? table.number(value) : table.empty();
}

template <class Vector>
void write_vector(const Vector& values, TableWriter& table) {
  for (const double value : values) write_number(value, table);
}

/// Columns `recording` (if there are several) and `time`.
std::vector<Column> first_columns(const std::vector<MotionEstimate>& estimates) {
  std::vector<Column> columns;
  if (estimates.size() > 1) {
    std::vector<std::string> files;
    for (const MotionEstimate& one : estimates) files.push_back(one.file);
    columns.emplace_back("recording", CellType::kLabel, files);
  }
  columns.emplace_back("time");
  return columns;
}

void begin_row(const ExplainedMotions& motions, std::size_t index, std::size_t row,
               TableWriter& table) {
  if (motions.estimates.size() > 1) table.label(static_cast<int>(index));
  table.number(motions.estimates[index].time[row]);
}

/// Number of leading rows whose configuration and velocity were found, up to and including the
/// first inner row without forces.
std::size_t found_rows(const MotionEstimate& estimate) {
  std::size_t rows = 0;
  while (rows < estimate.time.size()) {
    const auto row = static_cast<Eigen::Index>(rows);
    const bool inner = rows > 0 && rows + 1 < estimate.time.size();
    if (!estimate.q.col(row).allFinite() || !estimate.v.col(row).allFinite()) break;
    ++rows;
    if (inner && !estimate.force.col(row).allFinite()) break;
  }
  return rows;
}

/// Names of the sums of all recordings: the recorded ones first, then every link in any estimate.
std::vector<std::string> all_sums(const ExplainedMotions& motions) {
  std::vector<std::string> out;
  for (const MotionEstimate& estimate : motions.estimates)
    for (const std::string& name : sum_names(motions.map, estimate.sums))
      if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(name);
  return out;
}

/// True if this component of the sum is recorded.
bool is_measured(const ColumnMap& map, std::size_t sum, std::size_t axis) {
  return sum < map.contact_forces.size() &&
         !map.contact_forces[sum].components[axis].column.empty();
}

std::vector<Column> force_columns(const ExplainedMotions& motions,
                                  const std::vector<std::string>& sums) {
  std::vector<Column> columns = first_columns(motions.estimates);
  for (const std::string& name : coordinate_names(motions.scene.model).force) {
    columns.emplace_back(name);
    columns.emplace_back(name + ".sd");
  }
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const std::string name = sums[k] + ".contact.";
    for (const char* axis : kAxes) columns.emplace_back(name + "f" + axis);
    for (const char* axis : kAxes) columns.emplace_back(name + "f" + axis + ".sd");
    for (const char* axis : kAxes) columns.emplace_back(name + axis);
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis)
      if (is_measured(motions.map, k, axis))
        columns.emplace_back(name + "f" + kAxes[axis] + ".measured");
  }
  return columns;
}

/// Writes the cells of one sum; they are empty if this recording lacks it (`own` < 0).
void write_sum(const ExplainedMotions& motions, std::size_t index, std::size_t row, std::size_t sum,
               int own, TableWriter& table) {
  const MotionEstimate& estimate = motions.estimates[index];
  const auto column = static_cast<Eigen::Index>(row);
  for (const MatrixX* values : {&estimate.sum_force, &estimate.sum_deviation, &estimate.sum_centre})
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      own < 0 ? table.empty() : write_number((*values)(3 * own + axis, column), table);
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis)
    if (is_measured(motions.map, sum, axis))
      write_number(recorded_at(motions.recordings[index], motions.recordings[index].contact_force,
                               static_cast<Eigen::Index>(3 * sum + axis), estimate.time[row]),
                   table);
}

}  // namespace

std::string numbered_file(const std::string& file, std::size_t index, std::size_t count) {
  if (count < 2 || file.empty()) return file;
  const std::filesystem::path path = file;
  return (path.parent_path() /
          fmt::format("{}_{}{}", path.stem().string(), index + 1, path.extension().string()))
      .string();
}

void write_motion_table(const std::string& file, const Model& model,
                        const MotionEstimate& estimate) {
  const CoordinateNames names = coordinate_names(model);
  std::vector<Column> columns{"time", "time_step"};
  for (const auto* list : {&names.q, &names.v, &names.force})
    columns.insert(columns.end(), list->begin(), list->end());
  TableWriter table(file, columns);
  const std::vector<char> motors = optimization::motors_of(model);
  const std::size_t rows = found_rows(estimate);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto column = static_cast<Eigen::Index>(row);
    const bool last = row + 1 == rows;
    table.number(estimate.time[row]);
    last ? table.empty() : table.number(estimate.time[row + 1] - estimate.time[row]);
    write_vector(VectorX(estimate.q.col(column)), table);
    write_vector(VectorX(estimate.v.col(column)), table);
    const bool own = estimate.force.col(column).allFinite() || rows < 2;
    const VectorX force = estimate.force.col(own ? column : 1);
    for (Eigen::Index i = 0; i < force.size(); ++i) {
      if (last)
        table.empty();
      else
        write_number(motors[static_cast<std::size_t>(i)] != 0 ? force[i] : 0.0, table);
    }
    table.end_row();
  }
  table.finish();
}

void write_contact_table(const std::string& file, const ExplainedMotions& motions) {
  const Model& model = motions.scene.model;
  std::vector<std::string> geometries;
  for (const Geometry& geometry : model.geometries()) geometries.push_back(geometry.name);
  std::vector<Column> columns = first_columns(motions.estimates);
  columns.emplace_back("geometry_a", CellType::kLabel, geometries);
  columns.emplace_back("geometry_b", CellType::kLabel, geometries);
  columns.insert(columns.end(), {"fx", "fy", "fz", "sd_fx", "sd_fy", "sd_fz", "x", "y", "z",
                                 "normal", "slip", "sliding"});
  TableWriter table(file, columns);
  const double least = kLeastForce * optimization::scene_weight(model);
  for (std::size_t i = 0; i < motions.estimates.size(); ++i) {
    const MotionEstimate& estimate = motions.estimates[i];
    for (std::size_t row = 0; row < estimate.contacts.size(); ++row) {
      for (const ContactEstimate& pair : estimate.contacts[row]) {
        if (pair.normal_force < least) continue;
        begin_row(motions, i, row, table);
        table.label(pair.geometry_a);
        table.label(pair.geometry_b);
        for (const Vector3* vector : {&pair.force, &pair.deviation, &pair.centre})
          write_vector(*vector, table);
        for (const double value : {pair.normal_force, pair.slip, pair.sliding ? 1.0 : 0.0})
          write_number(value, table);
        table.end_row();
      }
    }
  }
  table.finish();
}

void write_force_table(const std::string& file, const ExplainedMotions& motions) {
  const std::vector<std::string> sums = all_sums(motions);
  TableWriter table(file, force_columns(motions, sums));
  for (std::size_t i = 0; i < motions.estimates.size(); ++i) {
    const MotionEstimate& estimate = motions.estimates[i];
    const std::vector<std::string> own = sum_names(motions.map, estimate.sums);
    std::vector<int> place;  // index of each sum within this recording, or -1
    for (const std::string& name : sums) {
      const auto found = std::find(own.begin(), own.end(), name);
      place.push_back(found == own.end() ? -1 : static_cast<int>(found - own.begin()));
    }
    for (std::size_t row = 0; row < estimate.time.size(); ++row) {
      const auto column = static_cast<Eigen::Index>(row);
      begin_row(motions, i, row, table);
      for (Eigen::Index k = 0; k < estimate.force.rows(); ++k) {
        write_number(estimate.force(k, column), table);
        write_number(estimate.force_deviation(k, column), table);
      }
      for (std::size_t k = 0; k < sums.size(); ++k) write_sum(motions, i, row, k, place[k], table);
      table.end_row();
    }
  }
  table.finish();
}

}  // namespace counterpoint::apps
