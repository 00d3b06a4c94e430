// Polygons into triangles by cutting ears, corner by corner.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Triangles of a polygon whose corners are indices into vertices [m]; two less than it has
/// corners. It is looked at along the axis that the normal of its first bent corner is nearest to.
/// A corner is an ear if it turns as the whole does and no other corner lies in its triangle; the
/// search stays where an ear was cut (a flat convex polygon becomes a fan from its first corner)
/// and goes on by one where none was. Polygons that overlap themselves may give fewer. Bent
/// polygons enclose different volumes by how they are cut: this is the order in which MuJoCo reads
/// OBJ files (compared with MuJoCo 3.12.1).
std::vector<std::array<int, 3>> cut_ears(const std::vector<Vector3>& vertices,
                                         const std::vector<int>& polygon);

}  // namespace counterpoint
