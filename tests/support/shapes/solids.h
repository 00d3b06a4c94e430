// Meshes with known volumes, most of them closed and not convex.
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

/// A box low ... high whose faces point outwards or inwards; `lid`: with the top face.
inline TriangleMesh box_mesh(const Vector3& low, const Vector3& high, bool outwards = true,
                             bool lid = true) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                               i & 4 ? high.z() : low.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                    {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}, {4, 5, 6}, {5, 7, 6}};
  if (!lid) mesh.triangles.resize(10);
  if (!outwards)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Two meshes as one.
inline TriangleMesh both(TriangleMesh a, const TriangleMesh& b) {
  const int first = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles)
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return a;
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
