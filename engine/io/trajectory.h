// Trajectories: states and applied forces over time, in memory and as tables
// (docs/reference/trajectory-format.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/io/table.h"
#include "counterpoint/engine/io/input_columns.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Column of a trajectory with the state_hash (state.h) of each row, a whole number.
inline constexpr const char* kStateHashColumn = "state_hash";
/// Further columns of state files (state_file.h).
inline constexpr const char* kModelHashColumn = "model_hash";
inline constexpr const char* kOptionsHashColumn = "options_hash";
inline constexpr const char* kNextStepColumn = "next_step";
/// What each of these begins with: the memory of a state (state.h).
inline constexpr const char* kMemoryPrefix = "memory.";
/// Columns of a trajectory with the Softening (state.h) of the step that starts from each row.
inline constexpr const char* kSofteningColumn = "softening";
inline constexpr const char* kSoftenedTreeColumn = "softened_tree";

/// Names of the coordinates of a model, in the order of q, v and applied force.
struct CoordinateNames {
  std::vector<std::string> q;      ///< nq: "<joint>.q", "<link>.x", "<link>.qw" ...
  std::vector<std::string> v;      ///< nv: "<joint>.v", "<link>.vx", "<link>.wx" ...
  std::vector<std::string> force;  ///< nv: "<joint>.u", "<link>.fx", "<link>.tx" ...
};
CoordinateNames coordinate_names(const Model& model);

/// Writes a trajectory to a file as it is computed; its ending says the format (table.h).
class TrajectoryWriter {
 public:
  /// `columns`: beside applied forces. @throws InputError when the file cannot be created.
  TrajectoryWriter(const std::filesystem::path& file, const Model& model,
                   const InputColumns& columns = {});

  /// A state, what is applied during the step that starts from it, its length [s], and the
  /// softening that it reported.
  void write_step(const State& state, const Input& input, double time_step,
                  const Softening& softening = {});
  /// The last state: no step starts from it, its force and time_step cells are empty. Ends the file.
  void write_end(const State& state);

 private:
  void write_state(const State& state, std::optional<double> time_step);

  TableWriter table_;
  const Model& model_;
  InputColumns columns_;
  int num_inputs_;
};

/// Column k of q, v is row k of the file; column k of applied_force acts from row k to row k + 1.
struct Trajectory {
  std::string file;
  std::vector<double> time;  ///< [s], rising
  std::vector<double>
      time_step;          ///< [s], one fewer than rows; empty if the file has no such column
  MatrixX q;              ///< nq x rows
  MatrixX v;              ///< nv x rows
  MatrixX applied_force;  ///< nv x (rows - 1) [N, N m]; 0 x 0 if the file has no such columns
  std::vector<Softening> softening;  ///< by step; empty if the file has no such columns
  InputColumns columns;              ///< of servo targets and wrenches
  MatrixX known;                     ///< their values x (rows - 1)
  /// Rows whose numbers are not those that were written, by their state_hash; 0 without that
  /// column.
  int altered_rows = 0;

  /// What is known of what acted in a step, for its inverse; into `input`, all of it.
  void set_known(const Model& model, int step, Input& input) const;

  int num_rows() const { return static_cast<int>(time.size()); }
  int num_steps() const { return num_rows() - 1; }
};

/// Reads a trajectory of this model, bit for bit as written. Columns may come in any order; forces
/// of all kinds and time_step may be missing. @throws InputError naming file, line and column when
/// a coordinate is missing, a column unknown, a quaternion not of unit length (1e-6), time not
/// rising.
Trajectory read_trajectory(const std::filesystem::path& file, const Model& model,
                           const RowsRead& on_rows = {});

/// The length of every step [s]: the trajectory's own time_step column if it has one, else `given`
/// (if set) or `scene_step`, checked against the times. @throws InputError when these disagree.
std::vector<double> step_lengths(const Trajectory& trajectory, std::optional<double> given,
                                 double scene_step);

}  // namespace counterpoint
