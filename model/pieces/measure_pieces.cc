#include <algorithm>

#include "counterpoint/model/mesh/hull_distance.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

// Largest number of triangles whose points are measured.
constexpr std::size_t kMostMeasured = 2'000;
// Largest number of points of a piece that are measured.
constexpr int kMostPerPiece = 3'000;

/// Distance of a point from the union of the pieces [m]; 0 inside.
double distance_from(const Pieces& all, const Vector3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& piece : all.pieces) {
    if ((p - piece->interior_point).norm() - piece->radius > least) continue;
    if (excess(*piece, p) < least) least = std::min(least, distance_outside(*piece, p));
    if (least == 0.0) break;
  }
  return least;
}

}  // namespace

void measure_pieces(const Solid& solid, const TriangleMesh& mesh, Pieces& out) {
  out.outside = out.inside = 0.0;
  for (const auto& piece : out.pieces)
    out.outside = std::max(
        out.outside, outside_of(solid, *piece, out.outside, solid.size, kMostPerPiece).distance);
  const std::size_t stride = 1 + mesh.triangles.size() / kMostMeasured;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += stride) {
    const auto& t = mesh.triangles[i];
    const Vector3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vector3 places[] = {a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0};
    for (const Vector3& p : places) out.inside = std::max(out.inside, distance_from(out, p));
  }
}

}  // namespace counterpoint::pieces
