// Height fields from CSV files, including the conversion to terrain.
#include "counterpoint/model/geometry.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  const HeightGrid grid = load_height_table(write("heights.csv", input));
  if (grid.heights.size() != static_cast<size_t>(grid.rows) * grid.columns) std::abort();
  make_terrain(height_field_mesh(grid, 2.0, 3.0, 0.5, "heights"));
}

}  // namespace counterpoint::fuzz
