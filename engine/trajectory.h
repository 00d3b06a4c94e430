// Trajectories and saved states as tables: columns of states, applied forces and other inputs
// (docs/reference/trajectory-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

// ---- Servo targets and wrenches on links as columns of a table
// (docs/reference/trajectory-format.md).
//
//   J.target, J.target_velocity    targets of the servo of joint J
//   T.tendon_force, T.tendon_target  of tendon T
//   A.command                      of actuator A
//   C.attach                       of the switched closure C; empty: it stays as it is
//   J.target, L.target_x, L.target_qw ...  coordinates at the end of the step of a joint whose
//                                  motion is prescribed; empty: it stands still
//   L.fx L.fy L.fz L.tx L.ty L.tz  wrench on link L about its origin, in world axes [N, N m]
//
// For the child link of a planar, spherical or floating joint the names are L.wrench.fx ..., since
// L.fx ... are the applied forces of that joint.

/// The set of these columns in a table: some links, and of each other kind all or none. The values
/// of one row form a vector with as many entries as names(), NaN for an empty cell.
struct InputColumns {
  bool targets = false;
  std::vector<int> links;  ///< indices into Model::frames, ascending
  bool tendons = false;
  bool actuators = false;   ///< commands of all actuators
  bool closures = false;    ///< whether switched closures are attached
  bool prescribed = false;  ///< coordinates of all joints whose motion is prescribed

  /// Returns the columns of all inputs that the model has, without wrenches.
  static InputColumns of(const Model& model);
  bool empty() const {
    return !targets && links.empty() && !tendons && !actuators && !closures && !prescribed;
  }
  std::vector<std::string> names(const Model& model) const;
  /// Sets the parts of `input` that it has columns of, and replaces its wrenches by those that are
  /// not zero.
  void set(const Model& model, const VectorRef& values, Input& input) const;
  /// Returns the vector of values of `input`, the inverse of set(). Wrenches name their link
  /// (ExternalWrench::frame), one for each link at most. The model's targets replace missing ones.
  VectorX values(const Model& model, const Input& input) const;
};

/// Returns true if this is the name of such a column. Links fixed to the world have none.
bool is_input_column(const Model& model, const std::string& name);

/// Returns the input columns of a table, or of names; a link is included if one of its six columns
/// is present.
InputColumns find_input_columns(const Table& table, const Model& model);
InputColumns find_input_columns(const std::function<bool(const std::string&)>& has,
                                const Model& model);

/// Returns the values in the first `steps` rows of the table: one row per name, one column per
/// step. Missing columns have the model's targets, or zero wrenches, and leave closures and
/// prescribed joints as they are. @throws InputError where a closure is not to be attached (1) or
/// released (0); and where a cell of another column is empty, except in the last row of the table,
/// where that also means these defaults.
MatrixX read_input_columns(const InputColumns& columns, const Table& table, const Model& model,
                           int steps);

// ---- Trajectories: states and applied forces over time, in memory and as tables
// (docs/reference/trajectory-format.md).

/// Column of a trajectory with the state_hash (state.h) of each row, an integer.
inline constexpr const char* kStateHashColumn = "state_hash";
/// Further columns of state files (below).
inline constexpr const char* kModelHashColumn = "model_hash";
inline constexpr const char* kOptionsHashColumn = "options_hash";
inline constexpr const char* kNextStepColumn = "next_step";
/// Prefix of the columns with a state's memory (state.h).
inline constexpr const char* kMemoryPrefix = "memory.";
/// Columns of a trajectory with the Softening (state.h) of the step that starts from each row.
inline constexpr const char* kSofteningColumn = "softening";
inline constexpr const char* kSoftenedTreeColumn = "softened_tree";

/// Column names of the coordinates of a model, in the order of q, v and applied force.
struct CoordinateNames {
  std::vector<std::string> q;      ///< nq: "<joint>.q", "<link>.x", "<link>.qw" ...
  std::vector<std::string> v;      ///< nv: "<joint>.v", "<link>.vx", "<link>.wx" ...
  std::vector<std::string> force;  ///< nv: "<joint>.u", "<link>.fx", "<link>.tx" ...
  /// nz: "<actuator>.delayed0", ".setpoint", ".lagged", ".integral", ".current", ".activation",
  /// "<closure>.attached", ".attached_x", ".attached_qw" ...
  std::vector<std::string> z;
};
CoordinateNames coordinate_names(const Model& model);

/// Prefixes of the columns, one per link, with the factors of a TautLink (state.h) in the step that
/// starts from each row: "taut.<link>", "taut_kept.<link>".
inline constexpr const char* kTautPrefix = "taut.";
inline constexpr const char* kTautKeptPrefix = "taut_kept.";

/// Writes a trajectory to a file while it is computed; the file's ending selects the format.
class TrajectoryWriter {
 public:
  /// `columns`: inputs to write in addition to applied forces. @throws InputError when the file
  /// cannot be created.
  TrajectoryWriter(const std::filesystem::path& file, const Model& model,
                   const InputColumns& columns = {});

  /// Writes a state and, for the step that starts from it, the input, the length [s], the reported
  /// softening and the taut links.
  void write_step(const State& state, const Input& input, double time_step,
                  const Softening& softening = {}, const std::vector<TautLink>& taut_links = {});
  /// Writes the last state, from which no step starts (its force and time_step cells are empty),
  /// and closes the file.
  void write_end(const State& state);

 private:
  void write_state(const State& state, std::optional<double> time_step);

  TableWriter table_;
  const Model& model_;
  InputColumns columns_;
  std::vector<int> pulled_links_;  ///< bodies
  int num_inputs_;
};

/// A trajectory in memory. Column k of q and v is row k of the file; column k of applied_force acts
/// from row k to row k + 1.
struct Trajectory {
  std::string file;
  std::vector<double> time;  ///< [s], ascending
  /// Lengths of the steps [s], one fewer than rows; empty if the file has no such column.
  std::vector<double> time_step;
  MatrixX q;              ///< nq x rows
  MatrixX v;              ///< nv x rows
  MatrixX z;              ///< nz x rows; 0 x 0 if the file has no such columns
  MatrixX applied_force;  ///< nv x (rows - 1) [N, N m]; 0 x 0 if the file has no such columns
  std::vector<Softening> softening;  ///< one per step; empty if the file has no such columns
  /// One list per step; empty if the file has no such columns.
  std::vector<std::vector<TautLink>> taut_links;
  InputColumns columns;  ///< columns of servo targets and wrenches
  MatrixX known;         ///< values of `columns` x (rows - 1)
  /// Number of rows that were changed after writing, according to their state_hash; 0 without that
  /// column.
  int altered_rows = 0;
  bool has_hashes = false;  ///< the file has a state_hash column
  /// Returns true if every row is unchanged since writing and the length of every step is known.
  bool is_as_written() const { return has_hashes && altered_rows == 0 && !time_step.empty(); }

  /// Sets the inputs of a step that are known to its inverse in `input`: servo targets, wrenches,
  /// softening and taut links.
  void set_known(const Model& model, int step, Input& input) const;

  int num_rows() const { return static_cast<int>(time.size()); }
  int num_steps() const { return num_rows() - 1; }
};

/// Reads a trajectory of this model, bit for bit as written. Columns may be in any order; those of
/// forces and inputs, and time_step, may be missing. @throws InputError naming file, line and
/// column when a coordinate is missing, a column is unknown, the norm of a quaternion differs from
/// 1 by more than 1e-6, or time does not increase.
Trajectory read_trajectory(const std::filesystem::path& file, const Model& model,
                           const RowsRead& on_rows = {});

/// Returns the length of every step [s]: the trajectory's time_step column if it has one, else
/// `given` (if set), else `scene_step`; checked against the times. @throws InputError when these
/// disagree.
std::vector<double> step_lengths(const Trajectory& trajectory, std::optional<double> given,
                                 double scene_step);

/// Fills trajectory.z, if it is empty and the model has internal states: they start as those of the
/// model and follow from the motion and the known inputs, step by step. Steps that have no inverse
/// keep them. lengths: of the steps [s].
void find_internal_states(const Model& model, const SimulationOptions& options,
                          const std::vector<double>& lengths, Trajectory& trajectory);

// ---- State files, from which a run resumes with the same bits
// (docs/reference/trajectory-format.md, State files).

/// Returns a 64-bit hash of the data of a model that affect its motion: joints, inertias, shapes,
/// surface materials, forces in joints, drag, closures, gravity, excluded pairs.
std::uint64_t model_hash(const Model& model);
/// Returns a 64-bit hash of the options that affect the motion: time step and its control,
/// integrator, contact, effects, treatment of velocity-dependent forces and of deep overlaps.
std::uint64_t options_hash(const SimulationOptions& options);

/// Writes the state with its hash and those of model and options, and `next_step`, the length that
/// the next controlled step will try [s]. @throws InputError when the file cannot be created.
void write_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, const State& state,
                 std::optional<double> next_step = std::nullopt);

/// Whether model and options must be those that the state was saved from.
enum class SceneCheck { kSame, kAny };

/// Reads a state of this model, bit for bit as written; from a trajectory, its last row. @throws
/// InputError when a coordinate is missing or unknown; with SceneCheck::kSame also when the numbers
/// were changed after writing, or the model or options differ.
State read_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, SceneCheck check = SceneCheck::kSame);
/// Returns the length that the next controlled step will try [s], if the file has it. @throws
/// InputError if it is not positive.
std::optional<double> read_next_step(const std::filesystem::path& file);

}  // namespace counterpoint
