// Tables as NumPy's .npz, a zip archive of arrays: `numbers` (rows x columns) with names in
// `columns`, `integers` with names in `integer_columns`, and `labels` (pairs of a column's name and
// a label). `numbers` is written as rows arrive and its size at the end; if the run died before
// that, the archive has no directory and `numbers` extends to the end of the file.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>

#include "counterpoint/engine/io/npy_array.h"
#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/engine/io/zip_archive.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

class NpzSink final : public TableSink {
 public:
  NpzSink(const std::filesystem::path& file, const std::vector<Column>& columns)
      : zip_(file), integer_names_(names_of(columns, true)) {
    const std::vector<std::string> names = names_of(columns, false);
    num_numbers_ = names.size();
    add("columns", npy_strings(names, 1));
    std::vector<std::string> labels;
    for (const Column& column : columns)
      for (const std::string& label : column.labels) {
        labels.push_back(column.name);
        labels.push_back(label);
      }
    if (!labels.empty()) add("labels", npy_strings(labels, 2));
    if (!integer_names_.empty()) add("integer_columns", npy_strings(integer_names_, 1));
    zip_.begin_entry("numbers.npy", npy_header("<f8", 0, num_numbers_));
  }

  void write(const TableBlock& block) override {
    zip_.append({reinterpret_cast<const char*>(block.numbers.data()), 8 * block.numbers.size()});
    integers_.insert(integers_.end(), block.integers.begin(), block.integers.end());
    rows_ += static_cast<std::size_t>(block.rows);
  }

  void finish() override {
    zip_.end_entry(npy_header("<f8", rows_, num_numbers_));
    if (!integer_names_.empty())
      add("integers",
          npy_header("<u8", rows_, integer_names_.size()) +
              std::string(reinterpret_cast<const char*>(integers_.data()), 8 * integers_.size()));
    zip_.finish();
  }

 private:
  void add(const std::string& name, const std::string& content) {
    zip_.begin_entry(name + ".npy", content);
    zip_.end_entry(content);
  }

  ZipWriter zip_;
  std::vector<std::string> integer_names_;
  std::vector<std::uint64_t> integers_;  // kept in memory, written at the end
  std::size_t num_numbers_ = 0, rows_ = 0;
};

class NpzSource final : public TableSource {
 public:
  explicit NpzSource(const std::filesystem::path& file) : file_(file.string()), zip_(file) {
    const std::vector<std::string> names = strings("columns", 1, true);
    const std::vector<std::string> integer_names = strings("integer_columns", 1, false);
    columns_ = columns_of(names, integer_names, strings("labels", 2, false), file_);
    if (names.empty()) fail("no names in 'columns'");
    numbers_ = zip_.open("numbers.npy");
    if (!numbers_) fail("no array 'numbers'");
    rows_ = array("numbers", *numbers_, "<f8", names.size());
    if (zip_.cut_short()) rows_ = ~std::size_t{0};  // read to the end of the file
    if (!integer_names.empty()) open_integers(integer_names.size());
    num_numbers_ = names.size();
  }

  bool read(TableBlock& block) override {
    const std::size_t wanted = std::min(
        rows_ - read_, static_cast<std::size_t>(rows_of_block(num_numbers_ + num_integers_)));
    block.numbers.resize(wanted * num_numbers_);
    const std::size_t bytes =
        numbers_->read(reinterpret_cast<char*>(block.numbers.data()), 8 * block.numbers.size());
    std::size_t rows = bytes / 8 / num_numbers_;
    if (rows < wanted && !zip_.cut_short()) fail("array 'numbers' is cut short");
    block.numbers.resize(rows * num_numbers_);
    block.integers.resize(rows * num_integers_);
    if (num_integers_ > 0 && integers_->read(reinterpret_cast<char*>(block.integers.data()),
                                             8 * block.integers.size()) < 8 * block.integers.size())
      fail("array 'integers' is cut short");
    read_ += rows;
    block.rows = static_cast<int>(rows);
    return rows > 0;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(
        fmt::format("{}: {}; expected what counterpoint writes: arrays 'numbers' (rows x columns, "
                    "float64) and 'columns' (their names)",
                    file_, what));
  }

  std::vector<std::string> strings(const std::string& name, std::size_t width, bool needed) {
    const std::unique_ptr<ZipEntry> entry = zip_.open(name + ".npy");
    if (!entry && needed) fail(fmt::format("no array '{}'", name));
    if (!entry) return {};
    try {
      return read_npy_strings(*entry, width);
    } catch (const InputError& error) {
      fail(fmt::format("array '{}': {}", name, error.what()));
    }
  }

  /// Returns the number of rows of an array that must have this many columns.
  std::size_t array(const std::string& name, ZipEntry& entry, const std::string& type,
                    std::size_t columns) {
    NpyHeader header;
    try {
      header = read_npy_header(entry);
    } catch (const InputError& error) {
      fail(fmt::format("array '{}': {}", name, error.what()));
    }
    if (header.type != type || header.fortran_order)
      fail(fmt::format(
          "array '{}' is of type {}{}; {} in rows is expected (numpy.ascontiguousarray)", name,
          header.type, header.fortran_order ? " in columns" : "", type));
    if (header.shape.size() != 2 || header.shape[1] != columns)
      fail(fmt::format("array '{}' does not have the {} columns that are named", name, columns));
    return header.shape[0];
  }

  void open_integers(std::size_t columns) {
    integers_ = zip_.open("integers.npy");
    if (!integers_ && zip_.cut_short()) {  // the run died before it wrote them
      while (columns_.back().type == CellType::kInteger) columns_.pop_back();
      return;
    }
    if (!integers_) fail("no array 'integers'");
    if (array("integers", *integers_, "<u8", columns) != rows_)
      fail("arrays 'integers' and 'numbers' differ in the number of rows");
    num_integers_ = columns;
  }

  std::string file_;
  ZipReader zip_;
  std::unique_ptr<ZipEntry> numbers_, integers_;
  std::size_t num_numbers_ = 0, num_integers_ = 0, rows_ = 0, read_ = 0;
};

}  // namespace

std::unique_ptr<TableSource> open_npz(const std::filesystem::path& file, const TableOptions&) {
  return std::make_unique<NpzSource>(file);
}

std::unique_ptr<TableSink> create_npz(const std::filesystem::path& file,
                                      const std::vector<Column>& columns) {
  return std::make_unique<NpzSink>(file, columns);
}

}  // namespace counterpoint
