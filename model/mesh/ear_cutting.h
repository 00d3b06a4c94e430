// Triangulation of polygons by cutting ears.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Triangles of a polygon whose corners are indices of `vertices` [m]: two fewer than it has
/// corners, maybe less if it overlaps itself. Projects the polygon along the coordinate axis that
/// is nearest to the normal of its first bent corner. A corner is an ear if it turns in the
/// direction of the whole polygon and no other corner lies in its triangle. The search stays where
/// an ear was cut (a planar convex polygon becomes a fan from its first corner), and goes on by one
/// corner otherwise. The volume that non-planar polygons enclose depends on the cuts; this is the
/// order in which MuJoCo reads OBJ files (compared with MuJoCo 3.12.1).
std::vector<std::array<int, 3>> cut_ears(const std::vector<Vector3>& vertices,
                                         const std::vector<int>& polygon);

}  // namespace counterpoint
