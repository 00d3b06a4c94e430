// One-sided Hausdorff distance of hull and mesh by branch and bound: pieces of the hull's faces,
// those with the largest upper bound first, are measured at their centroid and halved.
#include "counterpoint/model/mesh/hull_standoff.h"

#include <limits>
#include <queue>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/triangle_distance.h"

namespace counterpoint {
namespace {

constexpr double kTolerance = 0.02;  // relative to the hull's diameter
constexpr int kMostMeasured = 3'000;

/// Finds the nearest triangle of a mesh with a tree of bounding boxes.
class NearestTriangle {
 public:
  explicit NearestTriangle(const TriangleMesh& mesh)
      : mesh_(mesh), tree_(mesh.vertices, mesh.triangles) {}

  struct Answer {
    double distance = std::numeric_limits<double>::infinity();
    int triangle = -1;
  };
  /// `guess`: index of a triangle that may be near, or -1.
  Answer find(const Vector3& p, int guess) const {
    Answer best;
    if (guess >= 0) best = {distance(p, guess), guess};
    search(0, p, best);
    return best;
  }
  double distance(const Vector3& p, int triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return distance_to_triangle(p, mesh_.vertices[t[0]], mesh_.vertices[t[1]],
                                mesh_.vertices[t[2]]);
  }

 private:
  static double distance(const Vector3& p, const TriangleTree::Node& box) {
    return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).norm();
  }

  void search(int index, const Vector3& p, Answer& best) const {
    const TriangleTree::Node& node = tree_.nodes[index];
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) {
        const double d = distance(p, tree_.order[i]);
        if (d < best.distance) best = {d, tree_.order[i]};
      }
      return;
    }
    int first = index + 1, second = node.right;
    double to_first = distance(p, tree_.nodes[first]), to_second = distance(p, tree_.nodes[second]);
    if (to_second < to_first) {
      std::swap(first, second);
      std::swap(to_first, to_second);
    }
    if (to_first < best.distance) search(first, p, best);
    if (to_second < best.distance) search(second, p, best);
  }

  const TriangleMesh& mesh_;
  const TriangleTree tree_;
};

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

/// Measures the distance at the centroid, tightens the bound, and returns the distance [m].
double measure(const NearestTriangle& mesh, Piece& piece) {
  const Vector3 center = piece.center();
  const NearestTriangle::Answer answer = mesh.find(center, piece.nearest);
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
  const double tolerance = kTolerance * 2.0 * hull.radius;
  std::priority_queue<Piece> queue;
  for (const std::vector<int>& face : hull.faces) {
    for (size_t i = 2; i < face.size(); ++i) {
      Piece piece{{hull.vertices[face[0]], hull.vertices[face[i - 1]], hull.vertices[face[i]]},
                  0.0};
      // Corners of the hull are vertices of the mesh, and no point of a triangle is farther from
      // its nearest corner than the longest edge.
      const int k = piece.longest_edge();
      piece.bound = (piece.corners[(k + 1) % 3] - piece.corners[k]).norm();
      queue.push(piece);
    }
  }
  double most = 0.0;
  for (int measured = 0; !queue.empty() && measured < kMostMeasured;) {
    Piece piece = queue.top();
    queue.pop();
    if (piece.bound <= most + tolerance) break;
    if (!piece.measured) {
      if (piece.nearest >= 0) piece.bound = std::min(piece.bound, bound_by(nearest, piece));
      if (piece.bound <= most + tolerance) continue;
      ++measured;
      most = std::max(most, measure(nearest, piece));
      if (piece.bound > most + tolerance) queue.push(piece);
      continue;
    }
    const int k = piece.longest_edge();
    const Vector3 half = 0.5 * (piece.corners[k] + piece.corners[(k + 1) % 3]);
    for (const int replaced : {k, (k + 1) % 3}) {
      Piece part = piece;
      part.corners[replaced] = half;
      part.measured = false;
      queue.push(part);
    }
  }
  return most;
}

}  // namespace counterpoint
