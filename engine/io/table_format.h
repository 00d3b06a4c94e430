// What a format of tables has to do: one file a format, listed in table.cc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"

namespace counterpoint {

/// Some rows of a table.
struct TableBlock {
  int rows = 0;
  std::vector<double> numbers;          ///< row by row, all columns but integers; NaN: empty
  std::vector<std::uint64_t> integers;  ///< row by row
  std::vector<std::string> texts;       ///< what cells of text columns are indices of
  std::vector<int> lines;               ///< of each row in the file; none: it has no lines
  /// By column, the message of the first cell that is no number; its value is NaN
  /// (TableOptions::any_cells).
  std::map<int, std::string> refused;

  void clear();
  std::size_t num_bytes() const { return 8 * (numbers.size() + integers.size()); }
};

/// Rows of about this many bytes are read and written together.
inline constexpr std::size_t kBlockBytes = 1 << 16;
/// More names than this are refused: a table is no matrix.
inline constexpr std::size_t kMaxColumns = 1'000'000;
/// As many rows, at least one.
int rows_of_block(std::size_t num_columns);

class TableSource {
 public:
  virtual ~TableSource() = default;
  const std::vector<Column>& columns() const { return columns_; }
  /// The next rows, at least one, into an empty block; false: there are none.
  virtual bool read(TableBlock& block) = 0;

 protected:
  std::vector<Column> columns_;
};

class TableSink {
 public:
  virtual ~TableSink() = default;
  /// Hands rows to the operating system. @throws std::runtime_error when that fails.
  virtual void write(const TableBlock& block) = 0;
  /// Ends the file; called once. @throws std::runtime_error when that fails.
  virtual void finish() = 0;
};

using OpenTable = std::unique_ptr<TableSource> (*)(const std::filesystem::path& file,
                                                   const TableOptions& options);
using CreateTable = std::unique_ptr<TableSink> (*)(const std::filesystem::path& file,
                                                   const std::vector<Column>& columns);

struct TableFormat {
  const char* name;                  ///< "HDF5"
  std::vector<std::string> endings;  ///< of files; the first is what messages recommend
  std::string magic;                 ///< what each such file begins with; "": nothing certain
  OpenTable open;                    ///< null: open_csv
  CreateTable create;                ///< null: such files are only read
  int names_line;                    ///< the line that names the columns; 0: it has no lines
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
std::unique_ptr<TableSource> open_c3d(const std::filesystem::path& file,
                                      const TableOptions& options);

/// Names as the first line of a CSV file, without its end; and the reverse. `where` is for
/// messages.
std::string csv_header(const std::vector<std::string>& names);
std::vector<std::string> parse_csv_header(const std::string& text, const std::string& where);

/// Columns of numbers (and labels) first, then those of integers: as formats keep them that have an
/// array of each.
std::vector<std::string> names_of(const std::vector<Column>& columns, bool integers);
/// The reverse; `labels`: pairs of a column's name and a label. @throws InputError for a label of
/// no column.
std::vector<Column> columns_of(const std::vector<std::string>& numbers,
                               const std::vector<std::string>& integers,
                               const std::vector<std::string>& labels, const std::string& file);

}  // namespace counterpoint
