#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr std::string_view kBlank = " \t\r";

double parse_height(std::string_view cell, const std::string& where) {
  cell = trimmed(cell, kBlank);
  const std::optional<double> value = parse_number(cell);
  if (!value || !std::isfinite(*value)) {
    throw InputError(
        fmt::format("{}: '{}' is no height; finite numbers [m] separated by commas "
                    "are expected",
                    where, cell));
  }
  return *value;
}

}  // namespace

HeightGrid load_height_table(const std::filesystem::path& file) {
  std::istringstream stream(read_text_file(file, limits::kMaxMeshBytes, "there is no such file"));
  HeightGrid grid;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string where = fmt::format("{}:{}", file.string(), number);
    std::string_view rest = trimmed(line, kBlank);
    if (rest.empty() || rest[0] == '#') continue;
    int columns = 0;
    for (bool more = true; more; ++columns) {
      const auto comma = rest.find(',');
      more = comma != std::string_view::npos;
      if (columns == limits::kMaxHeightsPerSide) {
        throw InputError(
            fmt::format("{}: more than {} columns", where, limits::kMaxHeightsPerSide));
      }
      if (grid.heights.size() == limits::kMaxHeights) {
        throw InputError(fmt::format("{}: more than {} heights; use a coarser grid", where,
                                     limits::kMaxHeights));
      }
      grid.heights.push_back(parse_height(rest.substr(0, comma), where));
      if (more) rest.remove_prefix(comma + 1);
    }
    if (grid.rows == 0) grid.columns = columns;
    if (columns != grid.columns) {
      throw InputError(
          fmt::format("{}: {} heights; the first row has {}", where, columns, grid.columns));
    }
    if (++grid.rows > limits::kMaxHeightsPerSide) {
      throw InputError(fmt::format("{}: more than {} rows", where, limits::kMaxHeightsPerSide));
    }
  }
  if (grid.rows == 0) throw InputError(fmt::format("{}: there are no heights", file.string()));
  return grid;
}

TriangleMesh height_field_mesh(const HeightGrid& grid, double size_x, double size_y, double scale,
                               const std::string& where) {
  if (grid.rows < 2 || grid.columns < 2) {
    throw InputError(fmt::format("{}: {} x {} heights; a field needs two rows and two columns",
                                 where, grid.rows, grid.columns));
  }
  TriangleMesh mesh;
  mesh.vertices.reserve(grid.heights.size());
  for (int r = 0; r < grid.rows; ++r) {
    const double y = size_y * (0.5 - static_cast<double>(r) / (grid.rows - 1));
    for (int c = 0; c < grid.columns; ++c) {
      const double x = size_x * (static_cast<double>(c) / (grid.columns - 1) - 0.5);
      mesh.vertices.emplace_back(x, y,
                                 scale * grid.heights[static_cast<size_t>(r) * grid.columns + c]);
    }
  }
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const int top = r * grid.columns + c;
      const int bottom = top + grid.columns;
      mesh.triangles.push_back({bottom, bottom + 1, top + 1});
      mesh.triangles.push_back({bottom, top + 1, top});
    }
  }
  return mesh;
}

}  // namespace counterpoint
