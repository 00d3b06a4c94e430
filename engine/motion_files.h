// Motions and states in files: tables, trajectories, columns of inputs, states to resume from.
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

// ---- Tables of numbers in files: rows under named columns. The file's ending says the format, in
// reading as in writing: .h5 or .hdf5 (HDF5), .npz (NumPy), .mcap (MCAP), read only .trc (TRC) and
// .c3d (C3D) of motion capture; all others are CSV (docs/reference/trajectory-format.md).

enum class CellType : unsigned char {
  kNumber,   ///< a double, may be empty
  kInteger,  ///< 64 bits without a sign: hashes
  kLabel,    ///< one of the column's labels; read as its index
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

/// How the tables of other programs are read.
struct TableOptions {
  /// Cells that hold no finite number are errors only where one is asked for, and so are names of
  /// several columns: all columns are numbers.
  bool any_cells = false;
  bool nan_is_empty = false;       ///< cells of CSV files that say nan are empty, with any_cells
  std::vector<std::string> names;  ///< of the columns of a CSV file without a header
  std::string topic;               ///< of an MCAP file of several ROS topics
  std::map<std::string, std::string>
      rows;  ///< only rows with this text in this column; CSV and ROS messages
};

/// Reads a table row by row, of any length: it keeps one block of rows in memory.
class TableReader {
 public:
  /// @throws InputError naming file and what was expected when the file cannot be read, is not of
  /// the format that its ending says, has no columns or a repeated column name; naming the package
  /// that is missing where the format was not built in. `label_columns`: those that hold names in
  /// CSV, where nothing says so; their labels are what was met so far.
  explicit TableReader(const std::filesystem::path& file,
                       const std::vector<std::string>& label_columns = {},
                       const TableOptions& options = {});
  ~TableReader();
  TableReader(const TableReader&) = delete;
  TableReader& operator=(const TableReader&) = delete;

  const std::string& file() const { return file_; }
  const std::vector<Column>& columns() const;
  int num_columns() const { return static_cast<int>(columns().size()); }
  /// Goes to the next row, at first to the first; false: there is none. @throws InputError naming
  /// file, row and column when the row is damaged or a cell is no finite number.
  bool next();
  /// Of the present row: NaN where the cell is empty or refused; of integers the nearest double.
  double cell(int column) const;
  /// With TableOptions::any_cells, the message of the first cell of each column that is no finite
  /// number.
  const std::map<int, std::string>& refused() const;
  /// Of the present row, of a column of integers.
  std::uint64_t integer(int column) const;
  /// The present row, for messages: "file:line" of CSV, "file: row 3" of others, counted from 1.
  std::string where() const;
  /// The line of the present row, from 1; 0 where the format has no lines.
  int line() const;

 private:
  void check_row();

  std::string file_;
  bool any_cells_;
  std::unique_ptr<TableSource> source_;
  std::unique_ptr<TableBlock> block_;
  std::vector<int> slots_;  ///< of each column, among those of its kind
  int num_numbers_ = 0, num_integers_ = 0;
  int row_ = -1;          ///< in the block
  long rows_before_ = 0;  ///< the block
};

/// Is told now and then how many rows have been read.
using RowsRead = std::function<void(int rows)>;

/// A whole table in memory. Empty cells are NaN. Text, "nan" and "inf" may stand where nobody
/// looks: whoever asks for such a cell is told that it is no number.
class Table {
 public:
  /// @throws InputError as TableReader, and for more cells than limits::kMaxTableCells.
  explicit Table(const std::filesystem::path& file, const RowsRead& on_rows = {},
                 TableOptions options = {});

  const std::string& file() const { return file_; }
  const std::vector<std::string>& columns() const { return columns_; }
  int num_rows() const { return num_rows_; }
  int num_columns() const { return static_cast<int>(columns_.size()); }
  /// Index of the named column; -1 if there is none. @throws InputError where there are several.
  int find_column(std::string_view name) const;
  /// As find_column. @throws InputError listing the columns there are.
  int column(std::string_view name) const;
  /// NaN where the cell is empty; of integers the nearest double. @throws InputError naming file,
  /// row, column and cell where a cell of this column is neither.
  double cell(int row, int column) const {
    const double number =
        cells_[static_cast<std::size_t>(row) * columns_.size() + static_cast<std::size_t>(column)];
    if (number != number && !refused_.empty()) check_refused(column);
    return number;
  }
  /// As cell. @throws InputError naming file, row and column where the cell is empty.
  double value(int row, int column) const;
  /// A row for messages: TableReader::where.
  std::string where(int row) const;
  /// The names of the columns for messages: "file:1" of CSV, "file:4" of TRC.
  std::string where_columns() const;

 private:
  void check_refused(int column) const;

  std::string file_;
  std::vector<std::string> columns_;
  std::map<int, std::string> refused_;  // TableReader::refused
  std::vector<double> cells_;           // row by row
  std::vector<int> lines_;              // of each row, counted from 1; empty where there are none
  int num_rows_ = 0;
  int names_line_ = 0;  // the line that names the columns; 0: the file has no lines
};

/// Writes a table row by row, cell by cell in the order of its columns. Reading it gives the same
/// bits. What was written stays readable if the process dies, but for the last rows (64 kB).
class TableWriter {
 public:
  /// @throws InputError when the file cannot be created, when the format is only read, when a
  /// column holds text and the format cannot, and naming the package that is missing where the
  /// format was not built in.
  TableWriter(const std::filesystem::path& file, std::vector<Column> columns);
  /// As finish, without errors.
  ~TableWriter();
  TableWriter(const TableWriter&) = delete;
  TableWriter& operator=(const TableWriter&) = delete;

  void number(double value);
  void integer(std::uint64_t value);
  /// Index into the column's labels.
  void label(int index) { number(index); }
  void text(std::string_view value);
  void empty();
  void end_row();
  /// Writes what is left and ends the file. @throws std::runtime_error when that fails (disk full).
  void finish();

 private:
  void write_block();

  std::string file_;
  std::vector<Column> columns_;
  std::unique_ptr<TableSink> sink_;
  std::unique_ptr<TableBlock> block_;
  std::size_t cells_in_row_ = 0;
};

/// Copies all rows into a file of another format. @throws InputError, std::runtime_error as both.
long copy_table(const std::filesystem::path& from, const std::filesystem::path& to);

// ---- Servo targets and wrenches on links as columns of a CSV file
// (docs/reference/trajectory-format.md).
//
//   J.target, J.target_velocity    of the servo of joint J
//   L.fx L.fy L.fz L.tx L.ty L.tz  on link L, about its origin, in world axes. Of a link that hangs
//                                  on a planar, spherical or floating joint: L.wrench.fx ..., since
//                                  L.fx ... are the applied forces of that joint

/// Which of these columns there are: none or all servos, and links. One moment is a vector of as
/// many values as names().
struct InputColumns {
  bool targets = false;
  std::vector<int> links;  ///< indices into Model::frames, rising

  bool empty() const { return !targets && links.empty(); }
  std::vector<std::string> names(const Model& model) const;
  /// Sets targets and wrenches of `input`: of servos if there are columns, wrenches in any case.
  void set(const Model& model, const VectorRef& values, Input& input) const;
  /// The reverse. input.wrenches must be as `set` leaves them; the model's targets where it has
  /// none.
  VectorX values(const Model& model, const Input& input) const;
};

/// Is it the name of such a column? Links fixed to the world have none.
bool is_input_column(const Model& model, const std::string& name);

/// The columns of a table. A link is in if one of its six is there.
InputColumns find_input_columns(const Table& table, const Model& model);

/// As many rows as names, `steps` columns, of the first `steps` rows of the table. What is not in
/// the table is the model's target, or zero. @throws InputError where a cell is empty, but in the
/// last row of the table, where that means the same.
MatrixX read_input_columns(const InputColumns& columns, const Table& table, const Model& model,
                           int steps);

// ---- Trajectories: states and applied forces over time, in memory and as tables
// (docs/reference/trajectory-format.md).

/// Column of a trajectory with the state_hash (state.h) of each row, a whole number.
inline constexpr const char* kStateHashColumn = "state_hash";
/// Further columns of state files (below).
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

/// What the columns of a trajectory begin with that have, by link, the factors of a TautLink
/// (state.h) of the step that starts from each row: "taut.<link>", "taut_kept.<link>".
inline constexpr const char* kTautPrefix = "taut.";
inline constexpr const char* kTautKeptPrefix = "taut_kept.";

/// Writes a trajectory to a file as it is computed; its ending says the format (Table).
class TrajectoryWriter {
 public:
  /// `columns`: beside applied forces. @throws InputError when the file cannot be created.
  TrajectoryWriter(const std::filesystem::path& file, const Model& model,
                   const InputColumns& columns = {});

  /// A state, what is applied during the step that starts from it, its length [s], the softening
  /// that it reported, and its taut links.
  void write_step(const State& state, const Input& input, double time_step,
                  const Softening& softening = {}, const std::vector<TautLink>& taut_links = {});
  /// The last state: no step starts from it, its force and time_step cells are empty. Ends the
  /// file.
  void write_end(const State& state);

 private:
  void write_state(const State& state, std::optional<double> time_step);

  TableWriter table_;
  const Model& model_;
  InputColumns columns_;
  std::vector<int> pulled_links_;  ///< bodies
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
  std::vector<std::vector<TautLink>> taut_links;  ///< the same
  InputColumns columns;                           ///< of servo targets and wrenches
  MatrixX known;                                  ///< their values x (rows - 1)
  /// Rows whose numbers are not those that were written, by their state_hash; 0 without that
  /// column.
  int altered_rows = 0;
  bool has_hashes = false;  ///< it has a state_hash column
  /// Every row is as it was written, after a step of known length.
  bool is_as_written() const { return has_hashes && altered_rows == 0 && !time_step.empty(); }

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

// ---- A state in a file, from which a run is resumed to the same bits
// (docs/reference/trajectory-format.md, State files).

/// Of all in a model that shapes its motion: joints, inertias, shapes, surfaces, what acts in
/// joints, closures, gravity, pairs left out.
std::uint64_t model_hash(const Model& model);
/// Of all in the options that does: time step and its control, integrator,
/// contact, effects.
std::uint64_t options_hash(const SimulationOptions& options);

/// Writes the state with its hash and those of model and options, and the length that the next
/// controlled step will try [s], if any. @throws InputError when the file cannot be created.
void write_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, const State& state,
                 std::optional<double> next_step = std::nullopt);

/// May the model and the options be others than those the state was saved from?
enum class SceneCheck { kSame, kAny };

/// Reads a state of this model, bit for bit as written; of a trajectory, its last row. @throws
/// InputError when a coordinate is missing or unknown, when the numbers are not those that were
/// written, and, if the scene is to be the same, when model or options are not.
State read_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, SceneCheck check = SceneCheck::kSame);
/// The length that the next controlled step will try [s], where the file says it. @throws
/// InputError where that is not positive.
std::optional<double> read_next_step(const std::filesystem::path& file);

}  // namespace counterpoint
