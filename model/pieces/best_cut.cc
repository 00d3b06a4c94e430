// The choice of a plane that cuts a part.
#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/model/pieces/hull_volume.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

// Number of planes through concave edges that are tried.
constexpr int kMostPlanes = 32;
// Planes whose normals differ by less, and whose offsets by less of the solid's size, are one.
constexpr double kSameNormal = 0.996, kSameOffset = 0.02;
// Cosine of the angle of an edge from which on the planes of its faces are tried as well as that
// between them, and from which on only those.
constexpr double kSharp = 0.95, kCorner = 0.5;
// Cuts that save nearly as much volume, relative to the most saved and to the hull, count as equal.
constexpr double kNearlyBest = 0.1, kNothing = 1e-4;
// Number of triangles beyond which cuts are weighed by a part of them.
constexpr std::size_t kMostTriangles = 1'000;
// Number of concave edges beyond which a part of them is looked at.
constexpr std::size_t kMostEdges = 1'000;

class Candidates {
 public:
  explicit Candidates(const Solid& solid) : solid_(solid) {}

  void add(const Vector3& normal, const Vector3& through) {
    if (!(normal.norm() > 0.5) || full()) return;  // degenerate normals are zero
    const CutPlane plane{normal, normal.dot(through)};
    for (const CutPlane& known : planes) {
      const double cosine = known.normal.dot(normal);
      const double shift = known.offset - (cosine < 0.0 ? -plane.offset : plane.offset);
      if (std::abs(cosine) > kSameNormal && std::abs(shift) < kSameOffset * solid_.size) return;
    }
    planes.push_back(plane);
  }
  bool full() const { return planes.size() >= kMostPlanes; }

  std::vector<CutPlane> planes;

 private:
  const Solid& solid_;
};

/// The part of a concave edge inside the cell, by how deep its middle lies in the hull.
struct Notch {
  double depth;
  int edge;
};

std::vector<Notch> notches(const Solid& solid, const Piece& piece) {
  std::vector<Notch> out;
  const std::size_t stride = 1 + piece.part.reflex.size() / kMostEdges;
  for (std::size_t i = 0; i < piece.part.reflex.size(); i += stride) {
    const int index = piece.part.reflex[i];
    const ReflexEdge& edge = solid.reflex[index];
    double from = 0.0, to = 1.0;
    for (const CutPlane& plane : piece.part.planes) {
      const double h = plane.height(edge.from) + 1e3 * solid.slack;
      const double g = plane.height(edge.to) + 1e3 * solid.slack;
      if (h > 0.0 && g > 0.0) to = -1.0;
      if (h * g < 0.0 && h > 0.0) from = std::max(from, h / (h - g));
      if (h * g < 0.0 && g > 0.0) to = std::min(to, h / (h - g));
    }
    if (!(to > from)) continue;
    const Vector3 middle = edge.from + 0.5 * (from + to) * (edge.to - edge.from);
    double depth = solid.size;
    for (std::size_t f = 0; f < piece.hull->faces.size(); ++f)
      depth =
          std::min(depth, piece.hull->face_offsets[f] - piece.hull->face_normals[f].dot(middle));
    // Rounded, so that edges of equal depth keep their order however the mesh is turned.
    if (depth > 1e3 * solid.slack) out.push_back({std::round(1e6 * depth / solid.size), index});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Notch& a, const Notch& b) { return a.depth > b.depth; });
  return out;
}

std::vector<CutPlane> through_edges(const Solid& solid, const std::vector<Notch>& deepest_first) {
  Candidates out(solid);
  for (const Notch& notch : deepest_first) {
    if (out.full()) break;
    const ReflexEdge& edge = solid.reflex[notch.edge];
    const double cosine = edge.normal_a.dot(edge.normal_b);
    if (cosine < kSharp) {
      out.add(edge.normal_a, edge.from);
      out.add(edge.normal_b, edge.from);
    }
    if (cosine < kCorner) continue;
    out.add((edge.to - edge.from).cross(edge.normal_a + edge.normal_b).normalized(), edge.from);
  }
  return std::move(out.planes);
}

/// Planes through the middle of the hull.
std::vector<CutPlane> across_axes(const Solid& solid, const Piece& piece) {
  std::vector<CutPlane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 normal = solid.axes.col(axis);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vector3& p : piece.hull->vertices) {
      low = std::min(low, normal.dot(p));
      high = std::max(high, normal.dot(p));
    }
    planes.push_back({normal, 0.5 * (low + high)});
  }
  return planes;
}

/// Returns the plane that leaves the least volume of hulls, of nearly equal ones the most even.
std::optional<CutPlane> best_of(const Solid& solid, const Piece& piece,
                                const std::vector<CutPlane>& planes) {
  const std::size_t stride = 1 + piece.part.triangles.size() / kMostTriangles;
  struct Score {
    double saved, balance;  // relative to the volume of the hull
  };
  std::vector<Score> scores;
  double most = 0.0;
  for (const CutPlane& plane : planes) {
    const Sides sides =
        piece.part.points_beside(plane, solid.slack, stride, solid.winding, *piece.hull);
    solid.work.spend(50 * piece.part.triangles.size() / stride + 10 * Work::kSearch);
    std::array<double, 2> volume{};
    for (int k = 0; k < 2; ++k)
      volume[k] = hull_volume(sides[k], solid.axes, solid.work) / piece.hull->volume;
    const double balance = std::min(volume[0], volume[1]);
    scores.push_back({balance > 0.0 ? 1.0 - volume[0] - volume[1] : -1.0, balance});
    most = std::max(most, scores.back().saved);
  }
  const double enough = most - std::max(kNearlyBest * most, kNothing);
  int best = -1;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (scores[i].balance <= 0.0 || scores[i].saved < enough) continue;
    if (best < 0 || scores[i].balance > scores[best].balance * (1.0 + 1e-6))
      best = static_cast<int>(i);
  }
  if (best < 0) return std::nullopt;
  return planes[best];
}

}  // namespace

std::optional<CutPlane> best_cut(const Solid& solid, Piece& piece) {
  const std::vector<Notch> edges = notches(solid, piece);
  solid.work.spend(std::min(piece.part.reflex.size(), kMostEdges) * piece.hull->faces.size());
  if (piece.part.reflex.size() < kMostEdges) {
    piece.part.reflex.clear();
    for (const Notch& notch : edges) piece.part.reflex.push_back(notch.edge);
    std::sort(piece.part.reflex.begin(), piece.part.reflex.end());
  }
  const std::optional<CutPlane> best = best_of(solid, piece, through_edges(solid, edges));
  // Without concave edges, as in an open mesh, across the axes.
  return best ? best : best_of(solid, piece, across_axes(solid, piece));
}

}  // namespace counterpoint::pieces
