// Interface of the table formats: one source file per format, listed in table.cc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/tables.h"

namespace counterpoint {

/// A block of rows of a table.
struct TableBlock {
  int rows = 0;
  std::vector<double> numbers;          ///< row by row, all columns except integers; NaN: empty
  std::vector<std::uint64_t> integers;  ///< row by row, columns of integers
  std::vector<std::string> texts;       ///< texts; a text cell's number is an index into these
  std::vector<int> lines;               ///< line of each row in the file; empty if there are none
  /// Column -> message of its first cell that is not a finite number, with TableOptions::any_cells;
  /// the value of such a cell is NaN. Kept by clear().
  std::map<int, std::string> refused;

  void clear();
  std::size_t num_bytes() const { return 8 * (numbers.size() + integers.size()); }
};

/// Approximate size [bytes] of the blocks that are read and written.
inline constexpr std::size_t kBlockBytes = 1 << 16;
/// Largest number of columns; more are refused, since such a file is a matrix, not a table.
inline constexpr std::size_t kMaxColumns = 1'000'000;
/// Returns the number of rows in a block of this size, at least one.
int rows_of_block(std::size_t num_columns);

class TableSource {
 public:
  virtual ~TableSource() = default;
  const std::vector<Column>& columns() const { return columns_; }
  /// Reads the next rows (at least one) into an empty block; false: there are none.
  virtual bool read(TableBlock& block) = 0;

 protected:
  std::vector<Column> columns_;
};

class TableSink {
 public:
  virtual ~TableSink() = default;
  /// Passes rows to the operating system. @throws std::runtime_error when that fails.
  virtual void write(const TableBlock& block) = 0;
  /// Completes the file; called once. @throws std::runtime_error when that fails.
  virtual void finish() = 0;
};

using OpenTable = std::unique_ptr<TableSource> (*)(const std::filesystem::path& file,
                                                   const TableOptions& options);
using CreateTable = std::unique_ptr<TableSink> (*)(const std::filesystem::path& file,
                                                   const std::vector<Column>& columns);

struct TableFormat {
  const char* name;                  ///< "HDF5"
  std::vector<std::string> endings;  ///< endings of file names; messages recommend the first
  std::string magic;                 ///< first bytes of every such file; "": not fixed
  OpenTable open;                    ///< null: use open_csv
  CreateTable create;                ///< null: read-only format
  int names_line;                    ///< line with the column names; 0: the file has no lines
};

std::unique_ptr<TableSource> open_csv(const std::filesystem::path& file,
                                      const std::vector<std::string>& label_columns,
                                      const TableOptions& options);
std::unique_ptr<TableSink> create_csv(const std::filesystem::path& file,
                                      const std::vector<Column>& columns);
std::unique_ptr<TableSource> open_hdf5(const std::filesystem::path& file,
                                       const TableOptions& options);
std::unique_ptr<TableSink> create_hdf5(const std::filesystem::path& file,
                                       const std::vector<Column>& columns);
/// The reader and writer of HDF5, a module (model/files/module.h).
struct Hdf5Format {
  std::unique_ptr<TableSource> (*open)(const std::filesystem::path& file);
  std::unique_ptr<TableSink> (*create)(const std::filesystem::path& file,
                                       const std::vector<Column>& columns);
};
std::unique_ptr<TableSource> open_npz(const std::filesystem::path& file,
                                      const TableOptions& options);
std::unique_ptr<TableSink> create_npz(const std::filesystem::path& file,
                                      const std::vector<Column>& columns);
std::unique_ptr<TableSource> open_mcap(const std::filesystem::path& file,
                                       const TableOptions& options);
std::unique_ptr<TableSink> create_mcap(const std::filesystem::path& file,
                                       const std::vector<Column>& columns);
std::unique_ptr<TableSource> open_trc(const std::filesystem::path& file,
                                      const TableOptions& options);
std::unique_ptr<TableSource> open_bvh(const std::filesystem::path& file,
                                      const TableOptions& options);
std::unique_ptr<TableSource> open_c3d(const std::filesystem::path& file,
                                      const TableOptions& options);

/// Converts column names to the first line of a CSV file, without its end, and back. `where` is for
/// messages.
std::string csv_header(const std::vector<std::string>& names);
std::vector<std::string> parse_csv_header(const std::string& text, const std::string& where);

/// Returns the names of the integer columns, or of all others (numbers and labels): the order in
/// formats that have one array of each.
std::vector<std::string> names_of(const std::vector<Column>& columns, bool integers);
/// Returns the columns from the names of both kinds. `labels`: pairs of a column's name and a
/// label. @throws InputError for a label of an unknown column.
std::vector<Column> columns_of(const std::vector<std::string>& numbers,
                               const std::vector<std::string>& integers,
                               const std::vector<std::string>& labels, const std::string& file);

}  // namespace counterpoint
