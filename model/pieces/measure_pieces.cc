#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/model/mesh/hull_distance.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

// Largest number of triangles whose points are measured.
constexpr std::size_t kMostMeasured = 2'000;
// A ray leaves the union after at most this many pieces.
constexpr int kMostCrossed = 64;
// Number of faces above a point, the nearest ones, across which its way out is sought.
constexpr std::size_t kMostWays = 64;

class Union {
 public:
  Union(const Solid& solid, const Pieces& pieces) : slack_(1e3 * solid.slack), all_(pieces) {}

  /// Distance of a point from the surface [m]; inside, that in the best of several directions, or
  /// in any in which it is at most `enough` [m]. `normal`: the first direction; if it leads farther
  /// and the point is `buried`, the distance is 0.
  template <typename Buried>
  double distance(const Vector3& p, const Vector3& normal, double enough,
                  const Buried& buried) const {
    double outside = std::numeric_limits<double>::infinity();
    std::vector<std::pair<double, Vector3>> ways;  // depth and direction
    bool deep = false;
    for (const auto& piece : all_.pieces) {
      if ((p - piece->interior_point).norm() - piece->radius > outside) continue;
      const double e = excess(*piece, p);
      if (e > outside) continue;
      outside = std::min(outside, e > slack_ ? distance_outside(*piece, p) : 0.0);
      deep = deep || e < -slack_;
      if (e > 0.0) continue;
      for (std::size_t f = 0; f < piece->faces.size(); ++f)
        ways.emplace_back(piece->face_offsets[f] - piece->face_normals[f].dot(p),
                          piece->face_normals[f]);
    }
    if (!deep) return outside;
    const std::size_t count = std::min(ways.size(), kMostWays);
    std::partial_sort(ways.begin(), ways.begin() + static_cast<std::ptrdiff_t>(count), ways.end(),
                      [](const auto& a, const auto& b) { return a.first < b.first; });
    double least = way_out(p, normal, std::numeric_limits<double>::infinity());
    if (least > enough && buried()) return 0.0;
    for (std::size_t i = 0; i < count && least > enough; ++i)
      least = std::min(least, way_out(p, ways[i].second, least));
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

void measure_pieces(const Solid& solid, const TriangleMesh& mesh, Pieces& out) {
  out.outside = out.inside = 0.0;
  for (const auto& piece : out.pieces)
    out.outside = std::max(out.outside, outside_of(solid, *piece, out.outside, solid.size));
  const Union whole(solid, out);
  const std::size_t stride = 1 + mesh.triangles.size() / kMostMeasured;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += stride) {
    const auto& t = mesh.triangles[i];
    const Vector3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vector3 normal = (b - a).cross(c - a).normalized();
    if (!(normal.norm() > 0.5)) continue;
    const Vector3 places[] = {a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0};
    for (const Vector3& p : places) {
      const auto buried = [&] { return solid.is_buried(p, normal); };
      const double distance = std::min(whole.distance(p, normal, out.inside, buried), solid.size);
      if (distance > out.inside && !buried()) out.inside = distance;
    }
  }
}

}  // namespace counterpoint::pieces
