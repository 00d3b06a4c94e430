// Reads the table of `counterpoint inverse --contacts`, which names shapes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"
#include "view/clip.h"

namespace counterpoint::view {
namespace {

class ContactTable {
 public:
  ContactTable(const std::filesystem::path& file, const Model& model)
      : reader_(file, {kColumns[1], kColumns[2]}) {
    for (size_t i = 0; i < model.geometries().size(); ++i)
      geometries_[model.geometries()[i].name] = static_cast<int>(i);
    const std::vector<Column>& columns = reader_.columns();
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::find_if(columns.begin(), columns.end(),
                                      [&](const Column& c) { return c.name == kColumns[i]; });
      if (found == columns.end())
        throw InputError(fmt::format("{}: no column '{}'; expected the table of inverse --contacts",
                                     reader_.file(), kColumns[i]));
      column_[i] = static_cast<int>(found - columns.begin());
    }
  }

  /// Reads the next contact and its time [s]; returns false at the end.
  bool next(double& time, Contact& contact) {
    if (!reader_.next()) return false;
    time = number(0);
    contact.geometry_a = geometry(1);
    contact.geometry_b = geometry(2);
    for (int i = 0; i < 3; ++i) {
      contact.position[i] = number(3 + i);
      contact.force[i] = number(6 + i);
    }
    return true;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}", reader_.where(), what));
  }

 private:
  static constexpr std::array<const char*, 9> kColumns = {
      "time", "geometry_a", "geometry_b", "x", "y", "z", "fx", "fy", "fz"};

  double number(int column) const {
    const double value = reader_.cell(column_[column]);
    if (std::isnan(value)) fail(fmt::format("column '{}' is empty", kColumns[column]));
    return value;
  }

  int geometry(int column) const {
    const Column& names = reader_.columns()[static_cast<size_t>(column_[column])];
    if (names.type != CellType::kLabel) fail(fmt::format("column '{}' has no labels", names.name));
    const std::string& name = names.labels[static_cast<size_t>(number(column))];
    const auto found = geometries_.find(name);
    if (found == geometries_.end())
      fail(fmt::format("the scene has no shape '{}'; these are the contacts of another scene",
                       name));
    return found->second;
  }

  TableReader reader_;
  std::map<std::string, int> geometries_;
  std::array<int, kColumns.size()> column_{};
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
    // No step starts from the last row: it shows the contacts of the last step.
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
