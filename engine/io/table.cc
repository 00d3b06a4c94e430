#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/model/files/file_format.h"
#include "counterpoint/model/files/module.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

const std::vector<TableFormat>& formats() {
  static const std::vector<TableFormat> all{
      {"CSV", {".csv"}, "", nullptr, create_csv, 1},
      {"HDF5", {".h5", ".hdf5"}, "\x89HDF\r\n\x1a\n", open_hdf5, create_hdf5, 0},
      {"NumPy", {".npz"}, "PK\x03\x04", open_npz, create_npz, 0},
      {"MCAP", {".mcap"}, "\x89MCAP0\r\n", open_mcap, create_mcap, 0},
      {"TRC", {".trc"}, "PathFile", open_trc, nullptr, 4},
      {"C3D", {".c3d"}, "", open_c3d, nullptr, 0},
      {"BVH", {".bvh"}, "HIERARCH", open_bvh, nullptr, 1}};
  return all;
}

/// Returns the format of a file by its ending; CSV for unknown endings.
const TableFormat& format_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const TableFormat& format : formats())
    if (std::count(format.endings.begin(), format.endings.end(), ending) > 0) return format;
  return formats().front();
}

/// Checks the first bytes of a regular file against its format; a pipe cannot be read twice.
void check_content(const std::filesystem::path& file, const TableFormat& format) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(file, error);
  if (!regular && format.names_line > 0) return;  // line readers report errors, or read the pipe
  if (!regular && !std::filesystem::is_directory(file, error) &&
      std::filesystem::exists(file, error))
    throw InputError(fmt::format("{}: no file that can be read twice; expected a {} file",
                                 file.string(), format.name));
  if (!regular) throw InputError(fmt::format("{}: {}", file.string(), why_unreadable(file)));
  std::string start(8, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  if (!format.magic.empty() && !start.starts_with(format.magic))
    throw InputError(fmt::format(
        "{}: no {} file, though its name ends like that of one; a CSV file ends in .csv",
        file.string(), format.name));
  for (const auto& [magic, what] :
       {std::pair{"#ROSBAG V",
                  "a bag of ROS 1; rostopic echo -b FILE -p TOPIC > FILE.csv makes a table of it"},
        std::pair{"SQLite f",
                  "an SQLite file (of rosbag2?); ros2 bag convert makes an .mcap file of it"}})
    if (start.starts_with(std::string_view(magic).substr(0, 8)))
      throw InputError(fmt::format("{}: {}", file.string(), what));
  for (const TableFormat& other : formats())
    if (format.magic.empty() && !other.magic.empty() && start.starts_with(other.magic))
      throw InputError(fmt::format("{}: a {} file; rename it to end in {}", file.string(),
                                   other.name, other.endings.front()));
}

void check_names(const std::vector<Column>& columns, const std::string& file) {
  if (columns.empty()) throw InputError(fmt::format("{}: no columns", file));
  std::vector<std::string> sorted;
  sorted.reserve(columns.size());
  for (const Column& column : columns) sorted.push_back(column.name);
  std::sort(sorted.begin(), sorted.end());
  const auto repeated = std::adjacent_find(sorted.begin(), sorted.end());
  if (repeated != sorted.end())
    throw InputError(fmt::format("{}:1: column '{}' occurs more than once", file, *repeated));
}

}  // namespace

void TableBlock::clear() {
  rows = 0;
  numbers.clear();
  integers.clear();
  texts.clear();
  lines.clear();
}

int rows_of_block(std::size_t num_columns) {
  return static_cast<int>(
      std::max<std::size_t>(1, kBlockBytes / 8 / std::max<std::size_t>(1, num_columns)));
}

std::unique_ptr<TableSource> open_hdf5(const std::filesystem::path& file, const TableOptions&) {
  return open_module<Hdf5Format>(Module::kHdf5, file).open(file);
}

std::unique_ptr<TableSink> create_hdf5(const std::filesystem::path& file,
                                       const std::vector<Column>& columns) {
  return open_module<Hdf5Format>(Module::kHdf5, file).create(file, columns);
}

std::vector<std::string> names_of(const std::vector<Column>& columns, bool integers) {
  std::vector<std::string> names;
  for (const Column& column : columns)
    if ((column.type == CellType::kInteger) == integers) names.push_back(column.name);
  return names;
}

std::vector<Column> columns_of(const std::vector<std::string>& numbers,
                               const std::vector<std::string>& integers,
                               const std::vector<std::string>& labels, const std::string& file) {
  std::vector<Column> columns(numbers.begin(), numbers.end());
  for (std::size_t i = 0; i + 1 < labels.size(); i += 2) {
    const auto column = std::find_if(columns.begin(), columns.end(),
                                     [&](const Column& c) { return c.name == labels[i]; });
    if (column == columns.end())
      throw InputError(
          fmt::format("{}: labels of a column '{}', which there is not", file, labels[i]));
    column->type = CellType::kLabel;
    column->labels.push_back(labels[i + 1]);
  }
  for (const std::string& name : integers) columns.emplace_back(name, CellType::kInteger);
  return columns;
}

TableReader::TableReader(const std::filesystem::path& file,
                         const std::vector<std::string>& label_columns, const TableOptions& options)
    : file_(file.string()), any_cells_(options.any_cells), block_(std::make_unique<TableBlock>()) {
  const TableFormat& format = format_of(file);
  check_content(file, format);
  if (!options.rows.empty() && format.open && format.open != open_mcap)
    throw InputError(fmt::format(
        "{}: rows cannot be chosen by their text: {} files hold numbers only", file_, format.name));
  source_ = format.open ? format.open(file, options) : open_csv(file, label_columns, options);
  if (!any_cells_) check_names(columns(), file_);
  for (const Column& column : columns()) {
    if (const std::string_view stated = format_of_column(column.name); !stated.empty())
      check_file_format(stated, fmt::format("{}: column '{}'", file_, column.name));
    slots_.push_back(column.type == CellType::kInteger ? num_integers_++ : num_numbers_++);
  }
}

TableReader::~TableReader() = default;

const std::vector<Column>& TableReader::columns() const { return source_->columns(); }

bool TableReader::next() {
  if (++row_ < block_->rows) {
    check_row();
    return true;
  }
  rows_before_ += block_->rows;
  row_ = -1;
  block_->clear();
  if (!source_->read(*block_)) return false;
  row_ = 0;
  check_row();
  return true;
}

const std::map<int, std::string>& TableReader::refused() const { return block_->refused; }

void TableReader::check_row() {
  for (int i = 0; i < num_columns(); ++i) {
    const Column& column = columns()[static_cast<std::size_t>(i)];
    if (column.type == CellType::kInteger) continue;
    const double x = cell(i);
    if (std::isinf(x)) {
      const std::string message =
          fmt::format("{}: column '{}': {} is no finite number", where(), column.name, x);
      if (!any_cells_) throw InputError(message);
      block_->refused.try_emplace(i, message);
      block_->numbers[static_cast<std::size_t>(row_) * static_cast<std::size_t>(num_numbers_) +
                      static_cast<std::size_t>(slots_[static_cast<std::size_t>(i)])] =
          std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    if (column.type == CellType::kLabel &&
        !(x >= 0.0 && x < static_cast<double>(column.labels.size()) && x == std::floor(x)))
      throw InputError(
          fmt::format("{}: column '{}': {} is the number of no label", where(), column.name, x));
  }
}

double TableReader::cell(int column) const {
  const auto slot = static_cast<std::size_t>(slots_[static_cast<std::size_t>(column)]);
  if (columns()[static_cast<std::size_t>(column)].type == CellType::kInteger)
    return static_cast<double>(integer(column));
  return block_
      ->numbers[static_cast<std::size_t>(row_) * static_cast<std::size_t>(num_numbers_) + slot];
}

std::uint64_t TableReader::integer(int column) const {
  const auto slot = static_cast<std::size_t>(slots_[static_cast<std::size_t>(column)]);
  return block_
      ->integers[static_cast<std::size_t>(row_) * static_cast<std::size_t>(num_integers_) + slot];
}

int TableReader::line() const {
  return block_->lines.empty() ? 0 : block_->lines[static_cast<std::size_t>(row_)];
}

std::string TableReader::where() const {
  if (line() > 0) return fmt::format("{}:{}", file_, line());
  return fmt::format("{}: row {}", file_, rows_before_ + row_ + 1);
}

Table::Table(const std::filesystem::path& file, const RowsRead& on_rows, TableOptions options)
    : file_(file.string()) {
  constexpr int kRows = 1024;  // rows between calls of on_rows
  options.any_cells = true;
  TableReader reader(file, {}, options);
  if (reader.num_columns() == 0) throw InputError(fmt::format("{}: no columns", file_));
  names_line_ = format_of(file).names_line;
  for (const Column& column : reader.columns()) columns_.push_back(column.name);
  while (reader.next()) {
    if (cells_.size() + columns_.size() > limits::kMaxTableCells)
      throw InputError(fmt::format("{}: more than {} cells; cut the table into several",
                                   reader.where(), limits::kMaxTableCells));
    for (int i = 0; i < reader.num_columns(); ++i) cells_.push_back(reader.cell(i));
    if (names_line_ > 0) lines_.push_back(reader.line());
    if (++num_rows_ % kRows == 0 && on_rows) on_rows(num_rows_);
  }
  refused_ = reader.refused();
}

void Table::check_refused(int column) const {
  if (const auto found = refused_.find(column); found != refused_.end())
    throw InputError(found->second);
}

int Table::find_column(std::string_view name) const {
  const auto it = std::find(columns_.begin(), columns_.end(), name);
  if (it == columns_.end()) return -1;
  if (std::find(it + 1, columns_.end(), name) != columns_.end())
    throw InputError(fmt::format("{}: column '{}' occurs more than once", where_columns(), name));
  return static_cast<int>(it - columns_.begin());
}

int Table::column(std::string_view name) const {
  const int index = find_column(name);
  if (index < 0) {
    const std::string cure = parse_number(columns_[0])
                                 ? "; the first line is no header: names, in a column map, "
                                   "are those of a file without one"
                                 : "";
    throw InputError(fmt::format("{}: no column '{}'; there are: {}{}", where_columns(), name,
                                 fmt::join(columns_, ", "), cure));
  }
  return index;
}

double Table::value(int row, int column) const {
  const double number = cell(row, column);
  if (std::isnan(number)) {
    throw InputError(fmt::format("{}: column '{}' is empty; expected a number", where(row),
                                 columns_[static_cast<std::size_t>(column)]));
  }
  return number;
}

std::string Table::where(int row) const {
  if (names_line_ > 0) return fmt::format("{}:{}", file_, lines_[static_cast<std::size_t>(row)]);
  return fmt::format("{}: row {}", file_, row + 1);
}

std::string Table::where_columns() const {
  return names_line_ > 0 ? fmt::format("{}:{}", file_, names_line_) : file_;
}

TableWriter::TableWriter(const std::filesystem::path& file, std::vector<Column> columns)
    : file_(file.string()), columns_(std::move(columns)), block_(std::make_unique<TableBlock>()) {
  const TableFormat& format = format_of(file);
  if (!format.create)
    throw InputError(
        fmt::format("{}: {} files are read, not written; let the name end in .csv, .h5, "
                    ".npz or .mcap",
                    file_, format.name));
  for (const Column& column : columns_)
    if (column.type == CellType::kText && format.open)
      throw InputError(fmt::format(
          "{}: column '{}' holds text, which only CSV has here; let the name end in .csv", file_,
          column.name));
  sink_ = format.create(file, columns_);
}

TableWriter::~TableWriter() {
  try {
    finish();
  } catch (const std::exception&) {  // call finish() to get errors
  }
}

void TableWriter::number(double value) {
  block_->numbers.push_back(value);
  ++cells_in_row_;
}

void TableWriter::integer(std::uint64_t value) {
  block_->integers.push_back(value);
  ++cells_in_row_;
}

void TableWriter::text(std::string_view value) {
  if (cells_in_row_ >= columns_.size() || columns_[cells_in_row_].type != CellType::kText)
    throw std::logic_error(fmt::format("{}: text in a column that is not of text", file_));
  block_->texts.emplace_back(value);
  number(static_cast<double>(block_->texts.size() - 1));
}

void TableWriter::empty() { number(std::numeric_limits<double>::quiet_NaN()); }

void TableWriter::end_row() {
  if (cells_in_row_ != columns_.size())
    throw std::logic_error(fmt::format("{}: a row of {} cells in a table of {} columns", file_,
                                       cells_in_row_, columns_.size()));
  cells_in_row_ = 0;
  ++block_->rows;
  if (block_->num_bytes() >= kBlockBytes) write_block();
}

void TableWriter::write_block() {
  sink_->write(*block_);
  block_->clear();
}

void TableWriter::finish() {
  if (!sink_) return;
  const std::unique_ptr<TableSink> sink = std::move(sink_);
  // Cells of an unfinished row are dropped.
  if (block_->rows > 0) {
    const auto integers = names_of(columns_, true).size();
    block_->integers.resize(static_cast<std::size_t>(block_->rows) * integers);
    block_->numbers.resize(static_cast<std::size_t>(block_->rows) * (columns_.size() - integers));
    sink->write(*block_);
  }
  sink->finish();
}

long copy_table(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  if (std::filesystem::equivalent(from, to, error))
    throw InputError(fmt::format("{}: cannot be copied onto itself", from.string()));
  TableReader reader(from);
  TableWriter writer(to, reader.columns());
  long rows = 0;
  for (; reader.next(); ++rows) {
    for (int i = 0; i < reader.num_columns(); ++i) {
      if (reader.columns()[static_cast<std::size_t>(i)].type == CellType::kInteger)
        writer.integer(reader.integer(i));
      else
        writer.number(reader.cell(i));
    }
    writer.end_row();
  }
  writer.finish();
  return rows;
}

}  // namespace counterpoint
