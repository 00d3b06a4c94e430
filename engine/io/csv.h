// Tables of numbers as CSV (RFC 4180): a header naming every column, then rows of numbers.
#pragma once

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint {

/// A table as read. Empty cells are NaN; written "nan" and "inf" are refused.
class CsvTable {
 public:
  /// @throws InputError naming file, line and column when the file cannot be read, has no header or
  /// a repeated column name, when a row is too short or too long, or a cell is no finite number.
  explicit CsvTable(const std::filesystem::path& file);

  const std::string& file() const { return file_; }
  const std::vector<std::string>& columns() const { return columns_; }
  int num_rows() const { return static_cast<int>(lines_.size()); }
  int num_columns() const { return static_cast<int>(columns_.size()); }
  /// Index of the named column; -1 if there is none.
  int find_column(std::string_view name) const;
  /// As find_column. @throws InputError listing the columns there are.
  int column(std::string_view name) const;
  /// NaN where the cell is empty.
  double cell(int row, int column) const { return cells_[row * columns_.size() + column]; }
  /// As cell. @throws InputError naming file, line and column where the cell is empty.
  double value(int row, int column) const;
  /// "file:line" of a row, for messages.
  std::string where(int row) const;

 private:
  void read_header(std::string_view text, size_t& position);
  void read_row(std::string_view line, int line_number);

  std::string file_;
  std::vector<std::string> columns_;
  std::vector<double> cells_;  // row by row
  std::vector<int> lines_;     // of each row, counted from 1
};

/// Writes a table row by row. Numbers carry 17 significant digits: reading them gives the same
/// bits.
class CsvWriter {
 public:
  /// Writes the header. @throws InputError when the file cannot be created.
  CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& columns);
  ~CsvWriter();
  CsvWriter(const CsvWriter&) = delete;
  CsvWriter& operator=(const CsvWriter&) = delete;

  void number(double value);
  void text(std::string_view value);
  void empty();
  void end_row();
  /// Hands everything to the operating system. @throws std::runtime_error when that fails (disk
  /// full).
  void flush();

 private:
  void separate();

  std::string file_;
  std::ofstream stream_;
  std::string buffer_;
  bool row_started_ = false;
};

}  // namespace counterpoint
