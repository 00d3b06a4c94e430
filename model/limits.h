// What a file may ask for before it is refused, so that a damaged or hostile one is answered with a
// message and not with all the memory, stack or time of the machine. Each limit is far beyond the
// largest model known to us; docs/reference/limits.md says why each is what it is.
#pragma once

#include <cstddef>
#include <cstdint>

namespace counterpoint::limits {

// XML: URDF, SRDF, Collada. A mark ('<' or '=') becomes an element or attribute of about 100 bytes,
// twice for a URDF.
inline constexpr std::uintmax_t kMaxXmlBytes = 64'000'000;
inline constexpr std::size_t kMaxXmlMarks = 4'000'000;

// YAML: scenes, column maps. yaml-cpp takes about 400 bytes a node. An alias (*name) counts as
// often as it is used, with all that is below it: that is what a reader walks through.
inline constexpr std::uintmax_t kMaxYamlBytes = 8'000'000;
inline constexpr int kMaxYamlDepth = 32;
inline constexpr std::size_t kMaxYamlNodes = 2'000'000;

// Tables: trajectories, recordings, inputs, contact problems. A cell takes 8 bytes; what reads row
// by row (TableReader) has no limit of cells.
inline constexpr std::size_t kMaxTableLine = 64'000'000;  // bytes, also of all names of columns
inline constexpr std::size_t kMaxTableCells = 200'000'000;

// Meshes. Counted before vertices are welded: three a triangle in an STL file. A polygon of n
// corners takes time of order n^2 to n^3 to be cut into triangles.
inline constexpr std::uintmax_t kMaxMeshBytes = 500'000'000;
inline constexpr std::size_t kMaxMeshVertices = 5'000'000;
inline constexpr int kMaxPolygonCorners = 1'000;
/// Nodes of a Collada scene, those of instances counted wherever they are instanced, and their
/// depth.
inline constexpr std::size_t kMaxMeshNodes = 100'000;
inline constexpr int kMaxMeshDepth = 100;

// Height fields: a height becomes two triangles of terrain, about 450 bytes with all that connects
// them.
inline constexpr int kMaxHeightsPerSide = 4096;
inline constexpr std::size_t kMaxHeights = 4'194'304;  // 2048 x 2048

// Models. The mass matrix of a tree is checked for inertia in O(n^3).
inline constexpr int kMaxLinks = 5'000;  // of one URDF
inline constexpr int kMaxTreeCoordinates = 3'000;
inline constexpr int kMaxBodies = 200'000;
inline constexpr int kMaxGeometries = 1'000'000;
inline constexpr std::size_t kMaxExclusions = 2'000'000;
inline constexpr std::size_t kMaxClosures = 20'000;  // each looks for its name among the others

/// Lengths and positions [m], either way from zero; the resolution of a double there is 0.1 um.
inline constexpr double kMaxLength = 1e9;
/// A size [m] smaller than an atom's nucleus is a mistake.
inline constexpr double kMinLength = 1e-15;
/// Masses [kg] and moments of inertia [kg m^2]: products of a few of them stay finite, and so do
/// the inverses of the least.
inline constexpr double kMaxMass = 1e30;
inline constexpr double kMinMass = 1e-30;

}  // namespace counterpoint::limits
