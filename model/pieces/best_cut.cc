// The choice of a plane that cuts a part.
#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/model/mesh/triangle_distance.h"
#include "counterpoint/model/pieces/quick_hull.h"
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
// Cuts that remove nearly as many points or save nearly as much volume, relative to the most and to
// the hull, count as equal.
constexpr double kNearlyBest = 0.1, kNothing = 1e-4;
// Number of triangles beyond which cuts are weighed by a part of them.
constexpr std::size_t kMostTriangles = 1'000;
// Number of concave edges beyond which a part of them is looked at.
constexpr std::size_t kMostEdges = 1'000;
// Number of far points for which planes are tried through the nearest point of the part.
constexpr std::size_t kMostNearest = 12;
// Relative difference of volumes that count as equal, so that the order does not depend on
// rounding.
constexpr double kTie = 1e-6;
// Least volume of a part that is cut off without a gain, relative to the whole.
constexpr double kLeastPart = 1e-3;
// A far point outside of a hull by more than this, relative to the tolerance, is gone.
constexpr double kGone = 0.25;

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

void through_edges(const Solid& solid, const std::vector<Notch>& deepest_first, Candidates& out) {
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

/// Adds planes through the points of the part nearest to some far points, the first one's first:
/// across the way there, which a convex part would be behind, and along the triangle.
void add_planes_below(const Solid& solid, const Piece& piece, const std::vector<Vector3>& far,
                      Candidates& out) {
  const std::size_t stride = 1 + far.size() / kMostNearest;
  for (std::size_t i = 0; i < far.size(); i += stride) {
    const Vector3& p = far[i];
    double least = std::numeric_limits<double>::infinity();
    Vector3 foot = p, normal = Vector3::Zero();
    for (const Corners3& t : piece.part.triangles) {
      const Vector3 near = nearest_on_triangle(p, t[0], t[1], t[2]);
      if ((near - p).squaredNorm() >= least) continue;
      least = (near - p).squaredNorm();
      foot = near;
      normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    }
    solid.work.spend(30 * piece.part.triangles.size());
    out.add((p - foot).normalized(), foot);
    out.add(normal, foot);
  }
}

struct Score {
  double removed;  // number of far points that no hull has any more, relative to all; -1: no cut
  double saved;    // volume that no hull has any more, relative to the piece's
  double balance;  // the smaller one of the two volumes, relative to the piece's
};

Score score_of(const Solid& solid, const Piece& piece, const std::vector<Vector3>& far,
               const CutPlane& plane) {
  const std::size_t stride = 1 + piece.part.triangles.size() / kMostTriangles;
  const Sides sides =
      piece.part.points_beside(plane, solid.near, stride, solid.winding_simple, *piece.hull);
  solid.work.spend(50 * piece.part.triangles.size() / stride + 10 * Work::kSearch);
  const QuickHull hulls[] = {quick_hull(sides[0], solid.axes, solid.work),
                             quick_hull(sides[1], solid.axes, solid.work)};
  double removed = 0.0;
  for (const Vector3& p : far)
    if (!hulls[plane.height(p) < 0.0 ? 0 : 1].contains(p, kGone * solid.tolerance)) ++removed;
  solid.work.spend(far.size() * (hulls[0].faces.size() + hulls[1].faces.size()));
  Score out{removed / static_cast<double>(far.size()),
            1.0 - (hulls[0].volume + hulls[1].volume) / piece.hull->volume,
            std::min(hulls[0].volume, hulls[1].volume) / piece.hull->volume};
  // A side without volume is left out, which is a cut if it saves much.
  const bool drops = out.saved > kNearlyBest && !sides[0].empty() && !sides[1].empty();
  if (!(out.balance > 0.0) && !drops) out.removed = -1.0;
  return out;
}

/// Returns the plane that leaves the fewest far points in hulls, of nearly equal planes the one
/// that leaves the least volume, and of those the most even.
std::optional<CutPlane> best_of(const Solid& solid, const Piece& piece,
                                const std::vector<Vector3>& far,
                                const std::vector<CutPlane>& planes) {
  std::vector<Score> scores;
  double most_removed = 0.0, most_saved = kNothing;
  for (const CutPlane& plane : planes) {
    scores.push_back(score_of(solid, piece, far, plane));
    most_removed = std::max(most_removed, scores.back().removed);
  }
  const double removed = (1.0 - kNearlyBest) * most_removed;
  for (const Score& score : scores)
    if (score.removed >= removed) most_saved = std::max(most_saved, score.saved);
  if (most_removed <= 0.0 && most_saved <= kNothing) {
    // In the middle of a face a dent has several walls, and the first cut alone saves nothing.
    for (std::size_t i = 0; i < planes.size(); ++i)
      if (scores[i].balance > kLeastPart) return planes[i];
    return std::nullopt;
  }
  const double saved = most_saved - std::max(kNearlyBest * most_saved, kNothing);
  int best = -1;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (scores[i].removed < removed || scores[i].saved < saved) continue;
    if (best < 0 || scores[i].balance > scores[best].balance * (1.0 + kTie))
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
  const std::vector<Vector3> far = far_points(solid, piece);
  Candidates planes(solid);
  add_planes_below(solid, piece, far, planes);
  through_edges(solid, edges, planes);
  const std::optional<CutPlane> best = best_of(solid, piece, far, planes.planes);
  // Without concave edges, as in an open mesh, across the axes.
  return best ? best : best_of(solid, piece, far, across_axes(solid, piece));
}

}  // namespace counterpoint::pieces
