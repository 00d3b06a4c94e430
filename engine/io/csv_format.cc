// Tables as CSV (RFC 4180): a header naming every column, then rows of numbers.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>

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

/// Hashes are the integers of our tables; in CSV the name alone tells.
CellType type_of(const std::string& name) {
  return name.ends_with("_hash") ? CellType::kInteger : CellType::kNumber;
}

/// Lines of a file of any length.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file)
      : name_(file.string()), stream_(file, std::ios::binary) {
    if (!stream_ || std::filesystem::is_directory(file))
      throw InputError(fmt::format("{}: cannot be read; expected a CSV file", name_));
  }

  /// The next line without its end (LF); false: there is none. Valid until the next call.
  bool next(std::string_view& line) {
    for (std::size_t searched = begin_;;) {
      const std::size_t end = buffer_.find('\n', searched);
      if (end != std::string::npos || (ended_ && begin_ < buffer_.size())) {
        const std::size_t stop = std::min(end, buffer_.size());
        line = std::string_view(buffer_).substr(begin_, stop - begin_);
        begin_ = std::min(stop + 1, buffer_.size());
        ++number_;
        return true;
      }
      if (ended_) return false;
      buffer_.erase(0, begin_);
      begin_ = 0;
      searched = buffer_.size();
      if (searched > limits::kMaxTableLine)
        throw InputError(fmt::format("{}:{}: a line of more than {} MB; is it a CSV file?", name_, number_ + 1,
                                     limits::kMaxTableLine / 1'000'000));
      fill();
    }
  }
  int number() const { return number_; }

 private:
  void fill() {
    const std::size_t old = buffer_.size();
    buffer_.resize(old + (1 << 18));
    stream_.read(buffer_.data() + old, 1 << 18);
    buffer_.resize(old + static_cast<std::size_t>(stream_.gcount()));
    ended_ = !stream_;
    if (stream_.bad()) throw InputError(fmt::format("{}: the file cannot be read", name_));
  }

  std::string name_;
  std::ifstream stream_;
  std::string buffer_;
  std::size_t begin_ = 0;
  int number_ = 0;  ///< of the line last read
  bool ended_ = false;
};

/// Is a quoted name still open at the end of this text?
bool quotes_open(std::string_view text) { return std::count(text.begin(), text.end(), '"') % 2 != 0; }

class CsvSource final : public TableSource {
 public:
  CsvSource(const std::filesystem::path& file, const std::vector<std::string>& label_columns)
      : file_(file.string()), lines_(file) {
    std::string header;
    std::string_view line;
    bool first = true;
    while ((first || quotes_open(header)) && lines_.next(line)) {
      if (first && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);  // byte order mark
      if (!first) header += '\n';
      header += line;
      first = false;
      if (header.size() > limits::kMaxTableLine)
        throw InputError(fmt::format("{}:1: a header of more than {} MB; is it a CSV file?", file_,
                                     limits::kMaxTableLine / 1'000'000));
    }
    for (std::string& name : parse_csv_header(header, file_ + ":1")) {
      const bool label = std::count(label_columns.begin(), label_columns.end(), name) > 0;
      const CellType type = label ? CellType::kLabel : type_of(name);
      columns_.emplace_back(std::move(name), type);
    }
  }

  bool read(TableBlock& block) override {
    std::string_view line;
    const int rows = rows_of_block(columns_.size());
    while (block.rows < rows && lines_.next(line)) {
      if (line.ends_with('\r')) line.remove_suffix(1);
      if (trimmed(line, kBlank).empty()) continue;
      read_row(line, block);
      block.lines.push_back(lines_.number());
      ++block.rows;
    }
    return block.rows > 0;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, lines_.number(), what));
  }

  void read_row(std::string_view line, TableBlock& block) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (begin > line.size())
        fail(fmt::format("{} cells; the header names {} columns", i, columns_.size()));
      if (columns_[i].type == CellType::kLabel) {
        block.numbers.push_back(label(columns_[i], line, begin));
        continue;
      }
      const std::size_t end = std::min(line.find(',', begin), line.size());
      const std::string_view cell = trimmed(line.substr(begin, end - begin), kBlank);
      begin = end + 1;
      if (columns_[i].type == CellType::kInteger)
        block.integers.push_back(integer(columns_[i], cell));
      else
        block.numbers.push_back(cell.empty() ? std::numeric_limits<double>::quiet_NaN()
                                             : number(columns_[i], cell));
    }
    if (begin <= line.size())
      fail(fmt::format("more cells than the {} columns of the header", columns_.size()));
  }

  /// The number of the name that begins there, quoted or not; then goes to the next cell.
  double label(Column& column, std::string_view line, std::size_t& begin) {
    std::string name;
    const bool quoted = begin < line.size() && line[begin] == '"';
    for (begin += quoted ? 1 : 0; begin < line.size() && (quoted || line[begin] != ','); ++begin) {
      if (quoted && line[begin] == '"' && !(begin + 1 < line.size() && line[++begin] == '"')) break;
      name += line[begin];
    }
    begin = std::max(begin, std::min(line.find(',', begin), line.size())) + 1;
    const auto [found, added] =
        labels_[column.name].try_emplace(name, static_cast<double>(column.labels.size()));
    if (added) column.labels.push_back(name);
    return found->second;
  }

  double number(const Column& column, std::string_view cell) const {
    double value = 0.0;
    const char* const first = cell.data() + (cell.front() == '+' ? 1 : 0);
    const auto [stop, error] = std::from_chars(first, cell.data() + cell.size(), value);
    if (error != std::errc() || stop != cell.data() + cell.size() || !std::isfinite(value))
      fail(fmt::format("column '{}': '{}' is no finite number", column.name, cell));
    return value;
  }

  /// Also as a program writes it that keeps doubles.
  std::uint64_t integer(const Column& column, std::string_view cell) const {
    if (cell.empty()) fail(fmt::format("column '{}' is empty; expected a whole number", column.name));
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error == std::errc() && stop == cell.data() + cell.size()) return value;
    const double rounded = number(column, cell);
    if (!(rounded >= 0.0 && rounded < 0x1p64 && rounded == std::floor(rounded)))
      fail(fmt::format("column '{}': '{}' is no whole number from 0 to 2^64 - 1", column.name, cell));
    return static_cast<std::uint64_t>(rounded);
  }

  std::string file_;
  LineReader lines_;
  std::map<std::string, std::map<std::string, double>> labels_;  ///< their numbers, by column
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
    if (!stream_) throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", file_));
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
                                      const std::vector<std::string>& label_columns) {
  return std::make_unique<CsvSource>(file, label_columns);
}

std::unique_ptr<TableSink> create_csv(const std::filesystem::path& file,
                                      const std::vector<Column>& columns) {
  return std::make_unique<CsvSink>(file, columns);
}

}  // namespace counterpoint
