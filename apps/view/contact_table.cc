// The table of `counterpoint inverse --contacts`, which names shapes: no table of numbers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include "counterpoint/model/files/text_file.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/types.h"
#include "view/clip.h"

namespace counterpoint::view {
namespace {

/// The cells of the next record (RFC 4180: a quoted cell may hold commas, quotes, line ends).
std::vector<std::string> next_record(const std::string& text, size_t& at, int& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  while (at < text.size()) {
    const char c = text[at++];
    if (c == '\n') ++line;
    if (quoted) {
      if (c != '"')
        cells.back() += c;
      else if (at < text.size() && text[at] == '"')
        cells.back() += text[at++];
      else
        quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      cells.emplace_back();
    } else if (c == '\n') {
      break;
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  return cells;
}

class ContactTable {
 public:
  ContactTable(const std::filesystem::path& file, const Model& model)
      : file_(file.string()),
        text_(read_text_file(file, limits::kMaxTableBytes,
                             "cannot be read; expected the table of inverse --contacts")) {
    for (size_t i = 0; i < model.geometries().size(); ++i)
      geometries_[model.geometries()[i].name] = static_cast<int>(i);
    const std::vector<std::string> header = next_record(text_, at_, line_);
    width_ = header.size();
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::find(header.begin(), header.end(), kColumns[i]);
      if (found == header.end()) fail(fmt::format("no column '{}'", kColumns[i]));
      column_[i] = static_cast<size_t>(found - header.begin());
    }
  }

  /// The next contact and its time [s]; false at the end.
  bool next(double& time, Contact& contact) {
    while (at_ < text_.size()) {
      row_line_ = line_;
      cells_ = next_record(text_, at_, line_);
      if (cells_.size() == 1 && cells_[0].empty()) continue;
      if (cells_.size() != width_)
        fail(fmt::format("{} cells; the header names {} columns", cells_.size(), width_));
      time = number(0);
      contact.geometry_a = geometry(1);
      contact.geometry_b = geometry(2);
      for (int i = 0; i < 3; ++i) {
        contact.position[i] = number(3 + i);
        contact.force[i] = number(6 + i);
      }
      return true;
    }
    return false;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, row_line_, what));
  }

 private:
  static constexpr std::array<const char*, 9> kColumns = {
      "time", "geometry_a", "geometry_b", "x", "y", "z", "fx", "fy", "fz"};

  double number(int column) const {
    const std::string& cell = cells_[column_[column]];
    double value = 0.0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
      fail(fmt::format("column '{}': '{}' is no finite number", kColumns[column], cell));
    return value;
  }

  int geometry(int column) const {
    const auto found = geometries_.find(cells_[column_[column]]);
    if (found == geometries_.end())
      fail(fmt::format("the scene has no shape '{}'; these are the contacts of another scene",
                       cells_[column_[column]]));
    return found->second;
  }

  std::string file_, text_;
  std::map<std::string, int> geometries_;
  std::array<size_t, kColumns.size()> column_{};
  std::vector<std::string> cells_;
  size_t at_ = 0, width_ = 0;
  int line_ = 1, row_line_ = 1;
};

}  // namespace

void read_contacts(const std::filesystem::path& file, const Model& model, Clip& clip) {
  ContactTable table(file, model);
  std::vector<std::pair<double, Contact>> rows;
  double time = 0.0;
  Contact contact;
  while (table.next(time, contact)) {
    if (!rows.empty() && time < rows.back().first) table.fail("time goes back");
    rows.emplace_back(time, contact);
  }
  clip.contacts.clear();
  clip.has_contacts = true;
  const auto earlier = [](const auto& row, double t) { return row.first < t; };
  for (int frame = 0; frame < clip.num_frames(); ++frame) {
    double wanted = clip.states[frame].time;
    // No step starts from the last row: it is shown with the contacts of the last step.
    if (frame + 1 == clip.num_frames() && frame > 0 && !rows.empty() &&
        rows.back().first >= clip.states[frame - 1].time)
      wanted = std::min(wanted, rows.back().first);
    const double slack = 1e-9 * (1.0 + std::abs(wanted));
    auto row = std::lower_bound(rows.begin(), rows.end(), wanted - slack, earlier);
    for (; row != rows.end() && row->first <= wanted + slack; ++row) {
      clip.contacts.push_back(row->second);
      clip.contacts.back().frame = frame;
    }
  }
  if (!rows.empty() && clip.contacts.empty())
    throw InputError(fmt::format(
        "{}: no contact is at a time of the motion; these are the contacts of another one",
        file.string()));
}

}  // namespace counterpoint::view
