// Tables of numbers in files: rows under named columns. The file's ending says the format, in reading as in writing:
// .h5 or .hdf5 (HDF5), .npz (NumPy), .mcap (MCAP); all others are CSV (docs/reference/trajectory-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace counterpoint {

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

/// Reads a table row by row, of any length: it keeps one block of rows in memory.
class TableReader {
 public:
  /// @throws InputError naming file and what was expected when the file cannot be read, is not of the
  /// format that its ending says, has no columns or a repeated column name; naming the package that
  /// is missing where the format was not built in. `label_columns`: those that hold names in CSV,
  /// where nothing says so; their labels are what was met so far.
  explicit TableReader(const std::filesystem::path& file,
                       const std::vector<std::string>& label_columns = {});
  ~TableReader();
  TableReader(const TableReader&) = delete;
  TableReader& operator=(const TableReader&) = delete;

  const std::string& file() const { return file_; }
  const std::vector<Column>& columns() const;
  int num_columns() const { return static_cast<int>(columns().size()); }
  /// Goes to the next row, at first to the first; false: there is none. @throws InputError naming
  /// file, row and column when the row is damaged or a cell is no finite number.
  bool next();
  /// Of the present row: NaN where the cell is empty; of integers the nearest double.
  double cell(int column) const;
  /// Of the present row, of a column of integers.
  std::uint64_t integer(int column) const;
  /// The present row, for messages: "file:line" of CSV, "file: row 3" of others, counted from 1.
  std::string where() const;
  /// The line of the present row, from 1; 0 where the format has no lines.
  int line() const;

 private:
  void check_row() const;

  std::string file_;
  std::unique_ptr<TableSource> source_;
  std::unique_ptr<TableBlock> block_;
  std::vector<int> slots_;  ///< of each column, among those of its kind
  int num_numbers_ = 0, num_integers_ = 0;
  int row_ = -1;              ///< in the block
  long rows_before_ = 0;      ///< the block
};

/// Is told now and then how many rows have been read.
using RowsRead = std::function<void(int rows)>;

/// A whole table in memory. Empty cells are NaN; "nan" and "inf" are refused.
class Table {
 public:
  /// @throws InputError as TableReader, and for more cells than limits::kMaxTableCells.
  explicit Table(const std::filesystem::path& file, const RowsRead& on_rows = {});

  const std::string& file() const { return file_; }
  const std::vector<std::string>& columns() const { return columns_; }
  int num_rows() const { return num_rows_; }
  int num_columns() const { return static_cast<int>(columns_.size()); }
  /// Index of the named column; -1 if there is none.
  int find_column(std::string_view name) const;
  /// As find_column. @throws InputError listing the columns there are.
  int column(std::string_view name) const;
  /// NaN where the cell is empty; of integers the nearest double.
  double cell(int row, int column) const {
    return cells_[static_cast<std::size_t>(row) * columns_.size() +
                  static_cast<std::size_t>(column)];
  }
  /// As cell. @throws InputError naming file, row and column where the cell is empty.
  double value(int row, int column) const;
  /// A row for messages: TableReader::where.
  std::string where(int row) const;
  /// The names of the columns for messages: "file:1" of CSV.
  std::string where_columns() const;

 private:
  std::string file_;
  std::vector<std::string> columns_;
  std::vector<double> cells_;  // row by row
  std::vector<int> lines_;     // of each row, counted from 1; empty where there are none
  int num_rows_ = 0;
  bool has_lines_ = false;
};

/// Writes a table row by row, cell by cell in the order of its columns. Reading it gives the same
/// bits. What was written stays readable if the process dies, but for the last rows (64 kB).
class TableWriter {
 public:
  /// @throws InputError when the file cannot be created, when a column holds text and the format
  /// cannot, and naming the package that is missing where the format was not built in.
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

}  // namespace counterpoint
