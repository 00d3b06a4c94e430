// Height fields: a grid of heights from an image or a table, as triangles.
#pragma once

#include <filesystem>
#include <vector>

#include "counterpoint/model/mesh/mesh.h"

namespace counterpoint {

/// A grid of heights; row 0 lies at the largest y, columns run along +x, as an image is looked at.
struct HeightGrid {
  int rows = 0, columns = 0;
  std::vector<double> heights;  ///< row by row [m, or 0 ... 1 for an image]
};

/// A grayscale PNG of 1 to 16 bits a pixel, black 0, white 1, no gamma applied. @throws InputError
/// naming the file when it is missing, no PNG, in colour or with an alpha channel, damaged, or larger
/// than limits::kMaxHeights.
HeightGrid load_height_image(const std::filesystem::path& file);

/// Comma-separated heights [m], one row a line, no header; blank lines and lines that begin with #
/// are skipped. @throws InputError naming file and line when a row has another length than the first, a
/// cell is no finite number, or there are more than limits::kMaxHeights.
HeightGrid load_height_table(const std::filesystem::path& file);

/// Two triangles a cell, over size_x by size_y [m] around the origin, heights times `scale`.
/// @throws InputError (with `where`) for fewer than two rows or columns.
TriangleMesh height_field_mesh(const HeightGrid& grid, double size_x, double size_y, double scale,
                               const std::string& where);

}  // namespace counterpoint
