// Tables of numbers in files: rows under named columns. The ending of the file name selects the
// format for reading and writing: .h5 or .hdf5 (HDF5), .npz (NumPy), .mcap (MCAP), and for reading
// only .trc (TRC), .c3d (C3D) and .bvh (BVH) of motion capture; any other ending means CSV
// (docs/reference/trajectory-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

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
  /// The unit of lengths in BVH files, which they do not say, is known to the caller; places are
  /// in this unit. Otherwise such files are refused.
  bool any_unit = false;
  std::string topic;  ///< topic to read from an MCAP file with several ROS topics
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

}  // namespace counterpoint
