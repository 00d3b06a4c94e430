// Limits on the size of input files, so that a damaged or hostile file leads to an error message
// instead of exhausting memory, stack or time. Each limit is far beyond the largest model we know;
// docs/reference/limits.md gives the reason for each value.
#pragma once

#include <cstddef>
#include <cstdint>

namespace counterpoint::limits {

// XML (URDF, SRDF, Collada): a mark ('<' or '=') becomes an element or attribute of about 100
// bytes, twice that in a URDF.
inline constexpr std::uintmax_t kMaxXmlBytes = 64'000'000;
inline constexpr std::size_t kMaxXmlMarks = 4'000'000;

// YAML (scenes, column maps): yaml-cpp takes about 400 bytes per node. An alias (*name) counts once
// per use, with all nodes below it, because a reader visits them each time.
inline constexpr std::uintmax_t kMaxYamlBytes = 8'000'000;
inline constexpr int kMaxYamlDepth = 32;
inline constexpr std::size_t kMaxYamlNodes = 2'000'000;

// Tables (trajectories, recordings, inputs, contact problems): a cell takes 8 bytes. Row-by-row
// reading (TableReader) has no limit of cells.
inline constexpr std::size_t kMaxTableLine = 64'000'000;  // bytes; also of all column names
inline constexpr std::size_t kMaxTableCells = 200'000'000;

// Meshes: vertices are counted before welding, three per triangle in an STL file. Triangulating a
// polygon of n corners takes O(n^2) to O(n^3).
inline constexpr std::uintmax_t kMaxMeshBytes = 500'000'000;
inline constexpr std::size_t kMaxMeshVertices = 5'000'000;
inline constexpr int kMaxPolygonCorners = 1'000;
/// Number of nodes of a Collada scene, where the nodes of an instance count at every use, and their
/// depth.
inline constexpr std::size_t kMaxMeshNodes = 100'000;
inline constexpr int kMaxMeshDepth = 100;

// Height fields: a height becomes two terrain triangles, about 450 bytes with their connectivity.
inline constexpr int kMaxHeightsPerSide = 4096;
inline constexpr std::size_t kMaxHeights = 4'194'304;  // 2048 x 2048

// Models: the check of a tree's mass matrix takes O(n^3) for n coordinates.
inline constexpr int kMaxLinks = 5'000;  // links of one URDF
inline constexpr int kMaxTreeCoordinates = 3'000;
inline constexpr int kMaxBodies = 200'000;
inline constexpr int kMaxGeometries = 1'000'000;
inline constexpr std::size_t kMaxExclusions = 2'000'000;
inline constexpr std::size_t kMaxClosures = 20'000;   // the check for unique names is quadratic
inline constexpr std::size_t kMaxTendons = 20'000;    // the same check
inline constexpr std::size_t kMaxActuators = 20'000;  // the same check
inline constexpr int kMaxDelaySamples = 1'000;        // in the line of an actuator

/// Largest absolute length or position [m]; the resolution of a double there is 0.1 um.
inline constexpr double kMaxLength = 1e9;
/// Smallest size [m]: the size of an atomic nucleus; less is a mistake.
inline constexpr double kMinLength = 1e-15;
/// Bounds of masses [kg] and moments of inertia [kg m^2]: products of a few of them stay finite,
/// and so do the inverses of the smallest.
inline constexpr double kMaxMass = 1e30;
inline constexpr double kMinMass = 1e-30;

}  // namespace counterpoint::limits
