// Files of motions and states: tables, trajectories, columns of inputs, states from which a run
// resumes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

// ---- Tables of numbers in files: rows under named columns. The file name's ending selects the
// format for reading and writing: .h5 or .hdf5 (HDF5), .npz (NumPy), .mcap (MCAP), and for reading
// only .trc (TRC) and .c3d (C3D) of motion capture; any other ending means CSV
// (docs/reference/trajectory-format.md).

enum class CellType : unsigned char {
  kNumber,   ///< a double; may be empty
  kInteger,  ///< unsigned 64-bit integer, for hashes
  kLabel,    ///< one of the column's labels, read as its index
  kText,     ///< any text; CSV only
};

struct Column {
  Column(std::string n, CellType t = CellType::kNumber, std::vector<std::string> l = {})
      : name(std::move(n)), type(t), labels(std::move(l)) {}
  Column(const char* n) : name(n) {}

  std::string name;
  CellType type = CellType::kNumber;
  std::vector<std::string> labels;
};

struct TableBlock;
class TableSource;
class TableSink;

/// Options for reading tables written by other programs.
struct TableOptions {
  /// True: all columns are numbers; a cell that is not a finite number, or a repeated column name,
  /// is an error only when it is accessed.
  bool any_cells = false;
  bool nan_is_empty = false;       ///< with any_cells: "nan" in CSV files means empty
  std::vector<std::string> names;  ///< column names of a CSV file without a header
  std::string topic;               ///< topic to read from an MCAP file with several ROS topics
  /// Column name -> text: only rows with this text are read (CSV and ROS messages).
  std::map<std::string, std::string> rows;
};

/// Reads a table of any length row by row, keeping one block of rows in memory.
class TableReader {
 public:
  /// `label_columns`: columns of a CSV file that hold names, since the file does not say so; their
  /// labels are the names read so far.
  /// @throws InputError naming the file and the expected input when the file cannot be read, does
  /// not have the format of its ending, has no columns or a repeated column name; naming the
  /// missing package where the format was not built in.
  explicit TableReader(const std::filesystem::path& file,
                       const std::vector<std::string>& label_columns = {},
                       const TableOptions& options = {});
  ~TableReader();
  TableReader(const TableReader&) = delete;
  TableReader& operator=(const TableReader&) = delete;

  const std::string& file() const { return file_; }
  const std::vector<Column>& columns() const;
  int num_columns() const { return static_cast<int>(columns().size()); }
  /// Goes to the next row, at the first call to the first one; false: there is none. @throws
  /// InputError naming file, row and column when the row is damaged or a cell is not a finite
  /// number.
  bool next();
  /// Returns a cell of the current row: NaN if it is empty or refused; the nearest double for
  /// integers.
  double cell(int column) const;
  /// With TableOptions::any_cells: for each column, the message of its first cell that is not a
  /// finite number.
  const std::map<int, std::string>& refused() const;
  /// Returns a cell of the current row in a column of integers.
  std::uint64_t integer(int column) const;
  /// Returns the current row for messages: "file:line" for CSV, "file: row 3" for others, counted
  /// from 1.
  std::string where() const;
  /// Returns the line of the current row, from 1; 0 if the format has no lines.
  int line() const;

 private:
  void check_row();

  std::string file_;
  bool any_cells_;
  std::unique_ptr<TableSource> source_;
  std::unique_ptr<TableBlock> block_;
  std::vector<int> slots_;  ///< for each column, its index among the columns of its kind
  int num_numbers_ = 0, num_integers_ = 0;
  int row_ = -1;          ///< index of the current row in the block
  long rows_before_ = 0;  ///< rows in earlier blocks
};

/// Progress callback: called now and then with the number of rows read.
using RowsRead = std::function<void(int rows)>;

/// A whole table in memory. Empty cells are NaN. A cell with text, "nan" or "inf" is an error only
/// when it is accessed.
class Table {
 public:
  /// @throws InputError as TableReader, and for more than limits::kMaxTableCells cells.
  explicit Table(const std::filesystem::path& file, const RowsRead& on_rows = {},
                 TableOptions options = {});

  const std::string& file() const { return file_; }
  const std::vector<std::string>& columns() const { return columns_; }
  int num_rows() const { return num_rows_; }
  int num_columns() const { return static_cast<int>(columns_.size()); }
  /// Returns the index of the named column; -1 if there is none. @throws InputError if there are
  /// several.
  int find_column(std::string_view name) const;
  /// Returns the index of the named column. @throws InputError as find_column, and listing the
  /// columns if there is none of this name.
  int column(std::string_view name) const;
  /// Returns a cell: NaN if it is empty; the nearest double for integers. @throws InputError naming
  /// file, row, column and cell where a cell of this column is neither a finite number nor empty.
  double cell(int row, int column) const {
    const double number =
        cells_[static_cast<std::size_t>(row) * columns_.size() + static_cast<std::size_t>(column)];
    if (number != number && !refused_.empty()) check_refused(column);
    return number;
  }
  /// Returns a cell that must not be empty. @throws InputError as cell(), and naming file, row and
  /// column where it is empty.
  double value(int row, int column) const;
  /// Returns the name of a row for messages, as TableReader::where does.
  std::string where(int row) const;
  /// Returns the place of the column names for messages: "file:1" for CSV, "file:4" for TRC.
  std::string where_columns() const;

 private:
  void check_refused(int column) const;

  std::string file_;
  std::vector<std::string> columns_;
  std::map<int, std::string> refused_;  // see TableReader::refused
  std::vector<double> cells_;           // row by row
  std::vector<int> lines_;  // line of each row, counted from 1; empty if there are no lines
  int num_rows_ = 0;
  int names_line_ = 0;  // the line that names the columns; 0: the file has no lines
};

/// Writes a table row by row, cell by cell in the order of its columns. Reading it gives the same
/// bits. If the process dies, the file stays readable except for the last rows (64 kB).
class TableWriter {
 public:
  /// @throws InputError when the file cannot be created, the format is read-only, or a column holds
  /// text and the format cannot; naming the missing package where the format was not built in.
  TableWriter(const std::filesystem::path& file, std::vector<Column> columns);
  /// Calls finish() and ignores its errors.
  ~TableWriter();
  TableWriter(const TableWriter&) = delete;
  TableWriter& operator=(const TableWriter&) = delete;

  void number(double value);
  void integer(std::uint64_t value);
  /// Writes an index into the column's labels.
  void label(int index) { number(index); }
  void text(std::string_view value);
  void empty();
  void end_row();
  /// Writes the remaining rows and closes the file. @throws std::runtime_error when that fails
  /// (disk full).
  void finish();

 private:
  void write_block();

  std::string file_;
  std::vector<Column> columns_;
  std::unique_ptr<TableSink> sink_;
  std::unique_ptr<TableBlock> block_;
  std::size_t cells_in_row_ = 0;
};

/// Copies all rows into another file, whose ending selects the format. Returns the number of rows.
/// @throws InputError, std::runtime_error as TableReader and TableWriter.
long copy_table(const std::filesystem::path& from, const std::filesystem::path& to);

// ---- Servo targets and wrenches on links as columns of a table
// (docs/reference/trajectory-format.md).
//
//   J.target, J.target_velocity    targets of the servo of joint J
//   L.fx L.fy L.fz L.tx L.ty L.tz  wrench on link L about its origin, in world axes [N, N m]
//
// For the child link of a planar, spherical or floating joint the names are L.wrench.fx ..., since
// L.fx ... are the applied forces of that joint.

/// The set of these columns in a table: all servos or none, and some links. The values of one row
/// form a vector with as many entries as names().
struct InputColumns {
  bool targets = false;
  std::vector<int> links;  ///< indices into Model::frames, ascending

  bool empty() const { return !targets && links.empty(); }
  std::vector<std::string> names(const Model& model) const;
  /// Sets the servo targets of `input` if `targets` is true, and replaces its wrenches.
  void set(const Model& model, const VectorRef& values, Input& input) const;
  /// Returns the vector of values of `input`, the inverse of set(); input.wrenches must be in the
  /// order of `links`. The model's targets replace missing ones.
  VectorX values(const Model& model, const Input& input) const;
};

/// Returns true if this is the name of such a column. Links fixed to the world have none.
bool is_input_column(const Model& model, const std::string& name);

/// Returns the input columns of a table; a link is included if one of its six columns is present.
InputColumns find_input_columns(const Table& table, const Model& model);

/// Returns the values in the first `steps` rows of the table: one row per name, one column per
/// step. Missing columns have the model's targets, or zero wrenches. @throws InputError where a
/// cell is empty, except in the last row of the table, where that also means these defaults.
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
