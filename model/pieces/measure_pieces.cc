#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/model/mesh/hull_distance.h"
#include "counterpoint/model/mesh/hull_standoff.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

// Largest number of triangles whose points are measured.
constexpr std::size_t kMostMeasured = 2'000;
// A ray leaves the union after at most this many pieces.
constexpr int kMostCrossed = 64;

class Union {
 public:
  Union(const Solid& solid, const Pieces& pieces) : slack_(1e3 * solid.slack), all_(pieces) {}

  /// Largest depth of a point in a piece other than `own` [m]; negative if it is in none.
  double depth(const Vector3& p, const ConvexMesh* own) const {
    double most = -1.0;
    for (const auto& piece : all_.pieces)
      if (piece.get() != own && near(*piece, p)) most = std::max(most, -excess(*piece, p));
    return most;
  }

  /// Distance of a point from the surface [m]; inside, that in the best of several directions.
  double distance(const Vector3& p, const Vector3& normal) const {
    double outside = std::numeric_limits<double>::infinity();
    std::vector<Vector3> ways = {normal};
    bool deep = false;
    for (const auto& piece : all_.pieces) {
      if ((p - piece->interior_point).norm() - piece->radius > outside) continue;
      const double e = excess(*piece, p);
      if (e > outside) continue;
      outside = std::min(outside, e > slack_ ? distance_outside(*piece, p) : 0.0);
      deep = deep || e < -slack_;
      if (e <= 0.0) ways.insert(ways.end(), piece->face_normals.begin(), piece->face_normals.end());
    }
    if (!deep) return outside;
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3& way : ways) least = std::min(least, way_out(p, way, least));
    return least;
  }

 private:
  bool near(const ConvexMesh& piece, const Vector3& p) const {
    return (p - piece.interior_point).squaredNorm() < piece.radius * piece.radius;
  }

  /// Length of the way out of the union along a direction; infinite if it is longer than `most`.
  double way_out(const Vector3& p, const Vector3& way, double most) const {
    double length = 0.0;
    for (int k = 0; k < kMostCrossed; ++k) {
      const Vector3 at = p + length * way;
      double end = length;
      for (const auto& piece : all_.pieces) {
        if (!near(*piece, at) || excess(*piece, at) >= -slack_) continue;
        double leave = std::numeric_limits<double>::infinity();
        for (std::size_t f = 0; f < piece->faces.size(); ++f) {
          const double speed = piece->face_normals[f].dot(way);
          if (speed > 0.0)
            leave =
                std::min(leave, (piece->face_offsets[f] - piece->face_normals[f].dot(at)) / speed);
        }
        end = std::max(end, length + leave);
      }
      if (end == length) return length;
      length = end + 2.0 * slack_;  // into the next piece, if there is one
      if (length > most) break;
    }
    return std::numeric_limits<double>::infinity();
  }

  double slack_;
  const Pieces& all_;
};

}  // namespace

void measure_pieces(const Solid& solid, Pieces& out) {
  const Union whole(solid, out);
  out.outside = out.inside = 0.0;
  for (const auto& piece : out.pieces) {
    const PartStandoff query{solid.nearest,
                             [&](const Vector3& p, double distance) {
                               const double depth = whole.depth(p, piece.get());
                               return depth < 0.0 && solid.winding.inside(p) ? distance : depth;
                             },
                             0.25 * solid.tolerance};
    out.outside = std::max(out.outside, hull_standoff(*piece, query));
  }
  const std::size_t stride = 1 + solid.mesh.triangles.size() / kMostMeasured;
  for (std::size_t i = 0; i < solid.mesh.triangles.size(); i += stride) {
    const auto& t = solid.mesh.triangles[i];
    const Vector3 &a = solid.mesh.vertices[t[0]], &b = solid.mesh.vertices[t[1]],
                  &c = solid.mesh.vertices[t[2]];
    const Vector3 normal = (b - a).cross(c - a).normalized();
    if (!(normal.norm() > 0.5)) continue;
    const Vector3 places[] = {a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0};
    for (const Vector3& p : places) {
      const double distance = std::min(whole.distance(p, normal), solid.size);
      if (distance > out.inside && !solid.is_buried(p, normal)) out.inside = distance;
    }
  }
}

}  // namespace counterpoint::pieces
