// One-sided Hausdorff distance of hull and mesh by branch and bound: pieces of the hull's faces,
// those with the largest upper bound first, are measured at their centroid and halved.
#include "counterpoint/model/mesh/hull_standoff.h"

#include <algorithm>
#include <queue>

namespace counterpoint {
namespace {

constexpr double kTolerance = 0.02;  // relative to the hull's diameter

/// A triangle of the hull's surface.
struct Piece {
  std::array<Vector3, 3> corners;
  double bound;  // upper bound on the distance of its points from the mesh [m]
  bool measured = false;
  int nearest = -1;  // mesh triangle nearest to its centroid, or to that of its parent piece

  bool operator<(const Piece& other) const { return bound < other.bound; }
  Vector3 center() const { return (corners[0] + corners[1] + corners[2]) / 3.0; }
  int longest_edge() const {  // index of its first corner
    double length2[3];
    for (int k = 0; k < 3; ++k) length2[k] = (corners[(k + 1) % 3] - corners[k]).squaredNorm();
    return static_cast<int>(std::max_element(length2, length2 + 3) - length2);
  }
};

/// Upper bound on a piece's distance from its nearest triangle: the distance from a convex set is a
/// convex function, and so largest at a corner.
double bound_by(const NearestTriangle& mesh, const Piece& piece) {
  double most = 0.0;
  for (const Vector3& corner : piece.corners) {
    most = std::max(most, mesh.distance(corner, piece.nearest));
  }
  return most;
}

/// Measures the distance at the centroid, tightens the bound, and returns the distance [m]; `most`:
/// the largest distance so far.
double measure(const PartStandoff& part, double most, Piece& piece) {
  const NearestTriangle& mesh = part.mesh;
  const Vector3 center = piece.center();
  NearestTriangle::Answer answer = mesh.find(center, piece.nearest);
  if (answer.distance > most && part.depth) {
    const double depth = part.depth(center, answer.distance);
    if (depth >= 0.0) answer.distance = -depth;
  }
  piece.nearest = answer.triangle;
  piece.measured = true;
  // The distance is Lipschitz continuous with constant 1.
  double reach = 0.0;
  for (const Vector3& corner : piece.corners) reach = std::max(reach, (corner - center).norm());
  piece.bound = std::min({piece.bound, answer.distance + reach, bound_by(mesh, piece)});
  return answer.distance;
}

}  // namespace

double hull_standoff(const ConvexMesh& hull, const TriangleMesh& mesh) {
  const NearestTriangle nearest(mesh);
  return hull_standoff(hull, {nearest, nullptr, kTolerance * 2.0 * hull.radius}).distance;
}

FarthestPoint hull_standoff(const ConvexMesh& hull, const PartStandoff& part) {
  const double tolerance = part.tolerance;
  std::priority_queue<Piece> queue;
  for (const std::vector<int>& face : hull.faces) {
    for (size_t i = 2; i < face.size(); ++i) {
      Piece piece{{hull.vertices[face[0]], hull.vertices[face[i - 1]], hull.vertices[face[i]]},
                  0.0};
      // Corners of the hull are points of the solid, and no point of a triangle is farther from
      // its nearest corner than the longest edge.
      const int k = piece.longest_edge();
      piece.bound = (piece.corners[(k + 1) % 3] - piece.corners[k]).norm();
      queue.push(piece);
    }
  }
  FarthestPoint most{part.known};
  for (int measured = 0; !queue.empty() && measured < part.most;) {
    Piece piece = queue.top();
    queue.pop();
    if (piece.bound <= most.distance + tolerance) break;
    if (!piece.measured) {
      if (piece.nearest >= 0) piece.bound = std::min(piece.bound, bound_by(part.mesh, piece));
      if (piece.bound <= most.distance + tolerance) continue;
      ++measured;
      const double distance = measure(part, most.distance, piece);
      if (distance > most.distance) most = {distance, piece.center()};
      if (most.distance > part.enough) break;
      if (piece.bound > most.distance + tolerance) queue.push(piece);
      continue;
    }
    const int k = piece.longest_edge();
    const Vector3 half = 0.5 * (piece.corners[k] + piece.corners[(k + 1) % 3]);
    for (const int replaced : {k, (k + 1) % 3}) {
      Piece half_piece = piece;
      half_piece.corners[replaced] = half;
      half_piece.measured = false;
      queue.push(half_piece);
    }
  }
  return most;
}

}  // namespace counterpoint
