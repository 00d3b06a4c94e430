// Motion capture markers in TRC format (Motion Analysis, OpenSim): tab-separated text with five
// lines of header, then one frame per line. NumFrames is ignored: files that were cut keep the old
// number.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>

#include "counterpoint/engine/io/line_reader.h"
#include "counterpoint/engine/io/marker_columns.h"
#include "counterpoint/engine/io/table_format.h"

namespace counterpoint {
namespace {

class TrcSource final : public TableSource {
 public:
  explicit TrcSource(const std::filesystem::path& file)
      : file_(file.string()), lines_(file, "TRC") {
    need_line("the type of the file: PathFileType ...");
    need_line("what line 3 holds: DataRate, NumMarkers, Units ...");
    const std::vector<std::string> keys(cells_.begin(), cells_.end());
    need_line("the values of line 2");
    const std::map<std::string, std::string> values = values_of(keys);
    read_units(value(values, "Units"));
    const std::string num_markers = value(values, "NumMarkers");
    need_line("Frame#, Time and the names of the markers");
    name_columns(num_markers);
    need_line("the names of the coordinates: X1 Y1 Z1 ...");
    if (std::none_of(cells_.begin(), cells_.end(),
                     [](std::string_view c) { return c.starts_with('X') || c.starts_with('x'); }))
      fail("expected the names of the coordinates, separated by tabs: X1 Y1 Z1 ...");
  }

  bool read(TableBlock& block) override {
    const int rows = rows_of_block(columns_.size());
    while (block.rows < rows && next_line()) {
      if (std::all_of(cells_.begin(), cells_.end(), [](auto c) { return c.empty(); })) continue;
      append_row(block);
    }
    return block.rows > 0;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, lines_.number(), what));
  }

  /// Splits the next line into its cells; false: there is none.
  bool next_line() {
    std::string_view line;
    cells_.clear();
    if (!lines_.next(line)) return false;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find('\t', begin), line.size());
      cells_.push_back(trimmed(line.substr(begin, end - begin), " \r"));
      begin = end + 1;
    }
    return true;
  }

  void need_line(const char* what) {
    if (!next_line())
      throw InputError(
          fmt::format("{}:{}: the file ends; expected {}", file_, lines_.number() + 1, what));
  }

  /// Maps the cells of line 2 (names) to those of line 3 (values). If both have the same number of
  /// nonempty cells, empty ones are skipped: some programs write two tabs between values.
  std::map<std::string, std::string> values_of(std::vector<std::string> keys) const {
    std::vector<std::string> values(cells_.begin(), cells_.end()), full = values, full_keys = keys;
    std::erase(full, "");
    std::erase(full_keys, "");
    if (full.size() == full_keys.size()) {
      keys.swap(full_keys);
      values.swap(full);
    }
    std::map<std::string, std::string> by_key;
    for (std::size_t i = 0; i < keys.size() && i < values.size(); ++i) by_key[keys[i]] = values[i];
    return by_key;
  }

  const std::string& value(const std::map<std::string, std::string>& values,
                           const std::string& key) const {
    if (const auto found = values.find(key); found != values.end()) return found->second;
    fail(
        fmt::format("no value of {}; expected names in line 2 and, separated by tabs as they are, "
                    "their values in line 3",
                    key));
  }

  void read_units(std::string_view unit) {
    const std::optional<double> per_metre = units_per_metre(unit);
    if (!per_metre)
      fail(
          fmt::format("Units '{}'; expected mm, cm or m: write the unit that the coordinates have "
                      "there, or convert them",
                      unit));
    per_metre_ = *per_metre;
  }

  void name_columns(const std::string& num_markers) {
    if (cells_.size() < 2 || cells_[0].empty() || cells_[1].empty())
      fail("expected Frame#, Time and the names of the markers, separated by tabs");
    columns_ = {"frame", "time"};
    UniqueNames taken;
    for (std::size_t i = 2; i < cells_.size(); ++i) {
      if (cells_[i].empty()) continue;
      if (taken.size() == kMaxColumns / 3)
        fail(fmt::format("more than {} markers", kMaxColumns / 3));
      const std::string name = taken.take(std::string(cells_[i]));
      for (const char* axis : {".x", ".y", ".z"}) columns_.emplace_back(name + axis);
    }
    const std::optional<double> expected = parse_number(num_markers);
    if (!expected || *expected != static_cast<double>(taken.size()))
      fail(fmt::format("the names of {} markers; line 3 says that there are {} (NumMarkers)",
                       taken.size(), num_markers.empty() ? "none" : num_markers));
  }

  void append_row(TableBlock& block) {
    while (cells_.size() > columns_.size() && cells_.back().empty()) cells_.pop_back();
    if (cells_.size() > columns_.size())
      fail(fmt::format("{} cells; frame, time and {} markers have {}", cells_.size(),
                       columns_.size() / 3, columns_.size()));
    for (std::size_t i = 0; i < columns_.size(); ++i) block.numbers.push_back(number(i));
    for (std::size_t i = 2; i < columns_.size(); i += 3)
      check_marker(i, &block.numbers[block.numbers.size() - columns_.size() + i]);
    block.lines.push_back(lines_.number());
    ++block.rows;
  }

  /// Parses a cell; NaN if it is empty.
  double number(std::size_t column) const {
    if (column >= cells_.size() || cells_[column].empty())
      return std::numeric_limits<double>::quiet_NaN();
    const std::optional<double> x = parse_number(cells_[column]);
    if (!x || std::isinf(*x))
      fail(fmt::format("column '{}': '{}' is no finite number", columns_[column].name,
                       cells_[column]));
    return column < 2 ? *x : *x / per_metre_;
  }

  /// Clears a marker that was not seen, which some programs write as three zeros.
  void check_marker(std::size_t column, double* position) const {
    const auto empty = std::count_if(position, position + 3, [](double x) { return x != x; });
    if (empty == 1 || empty == 2)
      fail(fmt::format("column '{}': the marker has {} of its three coordinates",
                       columns_[column].name, 3 - empty));
    if (position[0] == 0.0 && position[1] == 0.0 && position[2] == 0.0)
      std::fill_n(position, 3, std::numeric_limits<double>::quiet_NaN());
  }

  std::string file_;
  LineReader lines_;
  std::vector<std::string_view> cells_;  ///< cells of the current line, valid until the next
  double per_metre_ = 1.0;               ///< units of the file per metre
};

}  // namespace

std::unique_ptr<TableSource> open_trc(const std::filesystem::path& file, const TableOptions&) {
  return std::make_unique<TrcSource>(file);
}

}  // namespace counterpoint
