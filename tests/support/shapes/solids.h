// Closed meshes with known volumes that are not convex.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint::test {

using Outline = std::vector<std::array<double, 2>>;

inline constexpr double kPi = 3.14159265358979323846;

/// Turns an outline of points (radius, z) about the z axis: a loop counter-clockwise seen with z
/// up and the axis left, or (`closed` false) a line from the axis to the axis.
inline TriangleMesh revolved(const Outline& outline, int sectors, bool closed) {
  TriangleMesh mesh;
  const int count = static_cast<int>(outline.size());
  std::vector<std::vector<int>> index(outline.size());
  for (int i = 0; i < count; ++i) {
    const auto [r, z] = outline[i];
    for (int k = 0; k < sectors; ++k) {
      if (r > 0.0 || k == 0) {
        const double angle = 2.0 * kPi * k / sectors;
        mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
      }
      index[i].push_back(static_cast<int>(mesh.vertices.size()) - 1);
    }
  }
  for (int i = 0; i < (closed ? count : count - 1); ++i) {
    for (int k = 0; k < sectors; ++k) {
      const int next = (k + 1) % sectors, up = (i + 1) % count;
      const int a = index[i][k], b = index[i][next], c = index[up][next], d = index[up][k];
      if (a != b) mesh.triangles.push_back({a, b, c});
      if (c != d) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

/// Moves an outline in x and y, star-shaped as seen from its first point, from z = 0 to `height`.
inline TriangleMesh extruded(const Outline& outline, double height) {
  TriangleMesh mesh;
  const int count = static_cast<int>(outline.size());
  for (const double z : {0.0, height})
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x, y, z);
  for (int i = 0; i < count; ++i) {
    const int next = (i + 1) % count;
    mesh.triangles.push_back({i, next, next + count});
    mesh.triangles.push_back({i, next + count, i + count});
  }
  for (int i = 2; i < count; ++i) {
    mesh.triangles.push_back({0, i, i - 1});
    mesh.triangles.push_back({count, count + i - 1, count + i});
  }
  return mesh;
}

/// Torus about z: radius of its circle, radius of its tube.
inline TriangleMesh torus(double radius, double tube, int sectors, int corners) {
  Outline circle;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * kPi * i / corners;
    circle.push_back({radius + tube * std::cos(angle), tube * std::sin(angle)});
  }
  return revolved(circle, sectors, true);
}

/// Cup on z = 0, open at the top, with a wall and a bottom of one thickness.
inline TriangleMesh cup(double radius, double height, double wall, int sectors) {
  return revolved({{0, 0},
                   {radius, 0},
                   {radius, height},
                   {radius - wall, height},
                   {radius - wall, wall},
                   {0, wall}},
                  sectors, false);
}

/// Part of a hollow ball below the cone of `angle` [rad] about the downward axis; the inner surface
/// has the radius given, and its centre is the origin.
inline TriangleMesh bowl(double radius, double wall, double angle, int rings, int sectors) {
  Outline outline;
  for (int i = 0; i <= rings; ++i)
    outline.push_back({(radius + wall) * std::sin(angle * i / rings),
                       -(radius + wall) * std::cos(angle * i / rings)});
  for (int i = rings; i >= 0; --i)
    outline.push_back(
        {radius * std::sin(angle * i / rings), -radius * std::cos(angle * i / rings)});
  return revolved(outline, sectors, false);
}

/// An L of arms 3 and 2 long, 1 wide and 1 thick [m]: 4 m^3.
inline TriangleMesh bracket() {
  return extruded({{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {0, 2}}, 1.0);
}

}  // namespace counterpoint::test
