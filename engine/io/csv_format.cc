// Tables as CSV (RFC 4180): a header with all column names, then rows of numbers.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>

#include "counterpoint/engine/io/line_reader.h"
#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr std::string_view kBlank = " \t";

bool needs_quotes(std::string_view s) {
  return s.find_first_of(",\"\r\n") != std::string_view::npos;
}

void append_text(std::string& out, std::string_view value) {
  if (!needs_quotes(value)) {
    out += value;
    return;
  }
  out += '"';
  for (const char c : value) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

/// Returns the type of a column by its name: in our tables only hashes are integers.
CellType type_of(const std::string& name) {
  return name.ends_with("_hash") ? CellType::kInteger : CellType::kNumber;
}

/// Returns true if a quoted name or cell is still open at the end of this text.
bool quotes_open(std::string_view text) {
  return std::count(text.begin(), text.end(), '"') % 2 != 0;
}

/// Reads the cell that starts at `begin`, without its quotes, and moves `begin` to the next cell. A
/// quoted cell is stored in `buffer`. Returns false if its quotes are not closed.
bool next_cell(std::string_view line, std::size_t& begin, std::string& buffer,
               std::string_view& cell) {
  const std::size_t first = std::min(line.find_first_not_of(kBlank, begin), line.size());
  if (first == line.size() || line[first] != '"') {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cell = line.substr(begin, end - begin);
    begin = end + 1;
    return true;
  }
  buffer.clear();
  for (std::size_t i = first + 1; i < line.size(); ++i) {
    if (line[i] == '"' && (i + 1 == line.size() || line[++i] != '"')) {
      cell = buffer;
      begin = std::min(line.find(',', i), line.size()) + 1;
      return true;
    }
    buffer += line[i];
  }
  return false;
}

class CsvSource final : public TableSource {
 public:
  CsvSource(const std::filesystem::path& file, const std::vector<std::string>& label_columns,
            const TableOptions& options)
      : file_(file.string()), lines_(file, "CSV"), options_(options) {
    std::vector<std::string> names = options.names;
    if (names.empty()) names = parse_csv_header(header(), file_ + ":1");
    for (std::string& name : names) {
      const bool label = std::count(label_columns.begin(), label_columns.end(), name) > 0;
      const CellType type = label               ? CellType::kLabel
                            : options.any_cells ? CellType::kNumber
                                                : type_of(name);
      columns_.emplace_back(std::move(name), type);
    }
    for (const auto& [name, text] : options.rows) {
      const auto column =
          std::find_if(columns_.begin(), columns_.end(),
                       [&wanted = name](const Column& c) { return c.name == wanted; });
      if (column == columns_.end())
        throw InputError(
            fmt::format("{}:1: no column '{}', whose text is to choose rows", file_, name));
      chosen_[static_cast<std::size_t>(column - columns_.begin())] = text;
    }
  }

  bool read(TableBlock& block) override {
    std::string_view line;
    const int rows = rows_of_block(columns_.size());
    while (block.rows < rows && next_row(line)) {
      if (trimmed(line, kBlank).empty()) continue;
      const std::size_t numbers = block.numbers.size(), integers = block.integers.size();
      if (!read_row(line, block)) {
        block.numbers.resize(numbers);
        block.integers.resize(integers);
        continue;
      }
      block.lines.push_back(line_);
      ++block.rows;
    }
    return block.rows > 0;
  }

 private:
  /// Returns the first line, with the lines over which its quoted names extend.
  std::string header() {
    std::string text;
    std::string_view line;
    bool first = true;
    while ((first || quotes_open(text)) && lines_.next(line)) {
      if (first && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);  // byte order mark
      if (!first) text += '\n';
      text += line;
      first = false;
      if (text.size() > limits::kMaxTableLine)
        throw InputError(fmt::format("{}:1: a header of more than {} MB; is it a CSV file?", file_,
                                     limits::kMaxTableLine / 1'000'000));
    }
    return text;
  }

  /// Reads the next line, with the lines over which its quoted cells extend.
  bool next_row(std::string_view& line) {
    if (!lines_.next(line)) return false;
    line_ = lines_.number();
    if (line.find('"') != std::string_view::npos) {
      std::size_t begin = 0;
      std::string_view cell;
      bool closed = true;
      while (closed && begin < line.size()) closed = next_cell(line, begin, buffer_, cell);
      if (!closed) {
        row_ = line;
        for (bool open = true; open && lines_.next(line); open = open != quotes_open(line)) {
          if (row_.size() + line.size() > limits::kMaxTableLine)
            fail("a quoted cell is not closed");
          row_.append("\n").append(line);
        }
        line = row_;
      }
    }
    if (line.ends_with('\r')) line.remove_suffix(1);
    return true;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line_, what));
  }

  /// Reads a row; false if it is not among the chosen ones.
  bool read_row(std::string_view line, TableBlock& block) {
    std::size_t begin = 0;
    std::string_view cell;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (begin > line.size())
        fail(fmt::format("{} cells; the header names {} columns", i, columns_.size()));
      if (!next_cell(line, begin, buffer_, cell)) fail("a quoted cell is not closed");
      const bool label = columns_[i].type == CellType::kLabel;
      if (!label) cell = trimmed(cell, kBlank);
      if (const auto wanted = chosen_.find(i); wanted != chosen_.end() && cell != wanted->second)
        return false;
      if (label)
        block.numbers.push_back(label_number(columns_[i], cell));
      else if (columns_[i].type == CellType::kInteger)
        block.integers.push_back(integer(columns_[i], cell));
      else
        block.numbers.push_back(cell.empty() ? std::numeric_limits<double>::quiet_NaN()
                                             : number(i, cell, block));
    }
    if (begin <= line.size() && options_.names.empty())
      fail(fmt::format("more cells than the {} columns of the header", columns_.size()));
    return true;
  }

  double label_number(Column& column, std::string_view cell) {
    const auto [found, added] = labels_[column.name].try_emplace(
        std::string(cell), static_cast<double>(column.labels.size()));
    if (added) column.labels.emplace_back(cell);
    return found->second;
  }

  static bool parse(std::string_view cell, double& value) {
    const char* const first = cell.data() + (cell.front() == '+' ? 1 : 0);
    const auto [stop, error] = std::from_chars(first, cell.data() + cell.size(), value);
    return error == std::errc() && stop == cell.data() + cell.size() && std::isfinite(value);
  }

  /// Parses a cell; returns NaN if it is not a finite number and any cells are accepted.
  double number(std::size_t i, std::string_view cell, TableBlock& block) const {
    double value = 0.0;
    if (parse(cell, value)) return value;
    if (!options_.any_cells)
      fail(fmt::format("column '{}': '{}' is no finite number", columns_[i].name, cell));
    if (options_.nan_is_empty && (cell == "nan" || cell == "NaN" || cell == "NAN"))
      return std::numeric_limits<double>::quiet_NaN();
    if (block.refused.try_emplace(static_cast<int>(i)).second)
      block.refused[static_cast<int>(i)] = fmt::format(
          "{}:{}: column '{}': '{}' is no finite number", file_, line_, columns_[i].name, cell);
    return std::numeric_limits<double>::quiet_NaN();
  }

  /// Parses an unsigned integer, also in the notation of programs that store doubles (1e3).
  std::uint64_t integer(const Column& column, std::string_view cell) const {
    if (cell.empty())
      fail(fmt::format("column '{}' is empty; expected a whole number", column.name));
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error == std::errc() && stop == cell.data() + cell.size()) return value;
    double rounded = 0.0;
    if (!parse(cell, rounded))
      fail(fmt::format("column '{}': '{}' is no finite number", column.name, cell));
    if (!(rounded >= 0.0 && rounded < 0x1p64 && rounded == std::floor(rounded)))
      fail(fmt::format("column '{}': '{}' is no whole number from 0 to 2^64 - 1", column.name,
                       cell));
    return static_cast<std::uint64_t>(rounded);
  }

  std::string file_;
  LineReader lines_;
  TableOptions options_;
  std::map<std::size_t, std::string> chosen_;  ///< column -> text of the rows to read
  std::string buffer_, row_;                   ///< text of a quoted cell; a row of several lines
  int line_ = 0;                               ///< first line of the current row
  std::map<std::string, std::map<std::string, double>> labels_;  ///< column -> label -> index
};

class CsvSink final : public TableSink {
 public:
  CsvSink(const std::filesystem::path& file, const std::vector<Column>& columns)
      : file_(file.string()), columns_(columns), stream_(file, std::ios::binary | std::ios::trunc) {
    if (!stream_) {
      throw InputError(fmt::format(
          "{}: cannot be created; expected a path in an existing, writable folder", file_));
    }
    std::vector<std::string> names;
    for (const Column& column : columns) names.push_back(column.name);
    stream_ << csv_header(names) << '\n';
  }

  void write(const TableBlock& block) override {
    const double* number = block.numbers.data();
    const std::uint64_t* integer = block.integers.data();
    buffer_.clear();
    for (int row = 0; row < block.rows; ++row) {
      for (std::size_t i = 0; i < columns_.size(); ++i) {
        if (i > 0) buffer_ += ',';
        if (columns_[i].type == CellType::kInteger)
          fmt::format_to(std::back_inserter(buffer_), "{}", *integer++);
        else
          append(columns_[i], *number++, block);
      }
      buffer_ += '\n';
    }
    stream_ << buffer_;
    finish();
  }

  void finish() override {
    stream_.flush();
    if (!stream_)
      throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", file_));
  }

 private:
  void append(const Column& column, double x, const TableBlock& block) {
    if (std::isnan(x)) return;
    if (column.type == CellType::kLabel)
      append_text(buffer_, column.labels[static_cast<std::size_t>(x)]);
    else if (column.type == CellType::kText)
      append_text(buffer_, block.texts[static_cast<std::size_t>(x)]);
    else
      fmt::format_to(std::back_inserter(buffer_), "{:.17g}", x);
  }

  std::string file_;
  std::vector<Column> columns_;
  std::ofstream stream_;
  std::string buffer_;
};

}  // namespace

std::string csv_header(const std::vector<std::string>& names) {
  std::string header;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) header += ',';
    append_text(header, names[i]);
  }
  return header;
}

std::vector<std::string> parse_csv_header(const std::string& text, const std::string& where) {
  std::vector<std::string> names;
  std::string name;
  bool quoted = false;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const bool end = i == text.size();
    const char c = end ? ',' : text[i];
    if (quoted) {
      if (end) throw InputError(fmt::format("{}: a quoted column name is not closed", where));
      if (c != '"') {
        name += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        name += text[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"' && trimmed(name, kBlank).empty()) {
      quoted = true;
      name.clear();
    } else if (c == ',') {
      if (names.size() == kMaxColumns)
        throw InputError(fmt::format("{}: more than {} columns", where, kMaxColumns));
      names.emplace_back(trimmed(name, kBlank));
      name.clear();
    } else if (c != '\r') {
      name += c;
    }
  }
  if (names.size() == 1 && names[0].empty())
    throw InputError(fmt::format("{}: empty; expected a header naming every column", where));
  return names;
}

std::unique_ptr<TableSource> open_csv(const std::filesystem::path& file,
                                      const std::vector<std::string>& label_columns,
                                      const TableOptions& options) {
  return std::make_unique<CsvSource>(file, label_columns, options);
}

std::unique_ptr<TableSink> create_csv(const std::filesystem::path& file,
                                      const std::vector<Column>& columns) {
  return std::make_unique<CsvSink>(file, columns);
}

}  // namespace counterpoint
