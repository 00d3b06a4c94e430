#include "counterpoint/engine/io/csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "counterpoint/model/files/text_file.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/types.h"

namespace counterpoint {
namespace {

constexpr size_t kFlushSize = 1 << 16;  // bytes

/// Splits off the next line, without its end (LF or CRLF).
std::string_view next_line(std::string_view text, size_t& position) {
  const size_t end = std::min(text.find('\n', position), text.size());
  std::string_view line = text.substr(position, end - position);
  position = std::min(end + 1, text.size());
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
  return s;
}

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

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file) : file_(file.string()) {
  const std::string text = read_text_file(file, limits::kMaxTableBytes,
                                          "cannot be read; expected a CSV file");
  size_t position = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;  // byte order mark
  read_header(text, position);
  int line_number = 1 + static_cast<int>(std::count(text.begin(), text.begin() + position, '\n'));
  for (; position < text.size(); ++line_number) {
    const std::string_view line = next_line(text, position);
    if (!trimmed(line).empty()) read_row(line, line_number);
  }
}

void CsvTable::read_header(std::string_view text, size_t& position) {
  bool quoted = false;
  bool ended = false;
  std::string name;
  while (!ended) {
    const char c = position < text.size() ? text[position++] : '\n';
    ended = position >= text.size() && c == '\n';
    if (quoted) {
      if (ended) throw InputError(fmt::format("{}:1: a quoted column name is not closed", file_));
      if (c != '"') {
        name += c;
      } else if (position < text.size() && text[position] == '"') {
        name += text[position++];
      } else {
        quoted = false;
      }
    } else if (c == '"' && trimmed(name).empty()) {
      quoted = true;
      name.clear();
    } else if (c == ',' || c == '\n') {
      columns_.emplace_back(trimmed(name));
      name.clear();
      ended = c == '\n';
    } else if (c != '\r') {
      name += c;
    }
  }
  if (columns_.size() == 1 && columns_[0].empty()) {
    throw InputError(fmt::format("{}:1: empty; expected a header naming every column", file_));
  }
  std::vector<std::string> sorted = columns_;
  std::sort(sorted.begin(), sorted.end());
  const auto repeated = std::adjacent_find(sorted.begin(), sorted.end());
  if (repeated != sorted.end()) {
    throw InputError(fmt::format("{}:1: column '{}' occurs more than once", file_, *repeated));
  }
}

void CsvTable::read_row(std::string_view line, int line_number) {
  const auto fail = [&](std::string_view what) {
    throw InputError(fmt::format("{}:{}: {}", file_, line_number, what));
  };
  if (cells_.size() + columns_.size() > limits::kMaxTableCells) {
    fail(fmt::format("more than {} cells; cut the table into several", limits::kMaxTableCells));
  }
  size_t begin = 0;
  for (size_t column = 0; column < columns_.size(); ++column) {
    if (begin > line.size()) {
      fail(fmt::format("{} cells; the header names {} columns", column, columns_.size()));
    }
    const size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view cell = trimmed(line.substr(begin, end - begin));
    begin = end + 1;
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!cell.empty()) {
      const char* const first = cell.data() + (cell.front() == '+' ? 1 : 0);
      const auto [stop, error] = std::from_chars(first, cell.data() + cell.size(), value);
      if (error != std::errc() || stop != cell.data() + cell.size() || !std::isfinite(value)) {
        fail(fmt::format("column '{}': '{}' is no finite number", columns_[column], cell));
      }
    }
    cells_.push_back(value);
  }
  if (begin <= line.size())
    fail(fmt::format("more cells than the {} columns of the header", columns_.size()));
  lines_.push_back(line_number);
}

int CsvTable::find_column(std::string_view name) const {
  const auto it = std::find(columns_.begin(), columns_.end(), name);
  return it == columns_.end() ? -1 : static_cast<int>(it - columns_.begin());
}

int CsvTable::column(std::string_view name) const {
  const int index = find_column(name);
  if (index < 0) {
    throw InputError(
        fmt::format("{}:1: no column '{}'; there are: {}", file_, name, fmt::join(columns_, ", ")));
  }
  return index;
}

double CsvTable::value(int row, int column) const {
  const double number = cell(row, column);
  if (std::isnan(number)) {
    throw InputError(
        fmt::format("{}: column '{}' is empty; expected a number", where(row), columns_[column]));
  }
  return number;
}

std::string CsvTable::where(int row) const { return fmt::format("{}:{}", file_, lines_[row]); }

CsvWriter::CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& columns)
    : file_(file.string()), stream_(file, std::ios::binary | std::ios::trunc) {
  if (!stream_) {
    throw InputError(fmt::format(
        "{}: cannot be created; expected a path in an existing, writable folder", file_));
  }
  for (const std::string& column : columns) text(column);
  end_row();
}

CsvWriter::~CsvWriter() { stream_ << buffer_; }

void CsvWriter::separate() {
  if (row_started_) buffer_ += ',';
  row_started_ = true;
}

void CsvWriter::number(double value) {
  separate();
  fmt::format_to(std::back_inserter(buffer_), "{:.17g}", value);
}

void CsvWriter::text(std::string_view value) {
  separate();
  append_text(buffer_, value);
}

void CsvWriter::empty() { separate(); }

void CsvWriter::end_row() {
  buffer_ += '\n';
  row_started_ = false;
  if (buffer_.size() >= kFlushSize) flush();
}

void CsvWriter::flush() {
  stream_ << buffer_ << std::flush;
  buffer_.clear();
  if (!stream_) throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", file_));
}

}  // namespace counterpoint
