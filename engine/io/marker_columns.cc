#include "counterpoint/engine/io/marker_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "counterpoint/engine/tables.h"

namespace counterpoint {
namespace {

std::array<int, 5> marker_columns(const TableReader& table) {
  std::array<int, 5> out{};
  const std::array<const char*, 5> names = {"marker", "link", "x", "y", "z"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& all = table.columns();
    const auto it =
        std::find_if(all.begin(), all.end(), [&](const Column& c) { return c.name == names[i]; });
    if (it == all.end())
      throw InputError(fmt::format("{}: there is no column '{}'; expected marker, link, x, y, z",
                                   table.file(), names[i]));
    out[i] = static_cast<int>(it - all.begin());
  }
  return out;
}

std::string label(const TableReader& table, int column) {
  const double index = table.cell(column);
  const auto& labels = table.columns()[static_cast<std::size_t>(column)].labels;
  if (!(index >= 0.0) || index >= static_cast<double>(labels.size()))
    throw InputError(table.where() + ": expected names of a marker and of its link");
  return labels[static_cast<std::size_t>(index)];
}

}  // namespace

std::vector<MarkerPlace> read_marker_places(const std::filesystem::path& file) {
  TableReader table(file, {"marker", "link"});
  const std::array<int, 5> columns = marker_columns(table);
  std::vector<MarkerPlace> places;
  while (table.next()) {
    const Vector3 point(table.cell(columns[2]), table.cell(columns[3]), table.cell(columns[4]));
    if (!point.allFinite())
      throw InputError(table.where() + ": expected x, y, z of the marker in its link [m]");
    places.push_back({label(table, columns[0]), label(table, columns[1]), point, table.where()});
  }
  return places;
}

}  // namespace counterpoint
