// The nearest triangle of a mesh, by a tree of bounding boxes.
#pragma once

#include <limits>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// Finds nearest triangles of a mesh, which must outlive it.
class NearestTriangle {
 public:
  explicit NearestTriangle(const TriangleMesh& mesh);

  struct Answer {
    double distance = std::numeric_limits<double>::infinity();  ///< [m]
    int triangle = -1;
  };
  /// `guess`: index of a triangle that may be near, or -1.
  Answer find(const Vector3& p, int guess = -1) const;
  /// Returns the distance of a point from one triangle [m].
  double distance(const Vector3& p, int triangle) const;
  const TriangleTree& tree() const { return tree_; }

 private:
  struct Best {
    double squared;  // [m^2]
    int triangle;
  };
  void search(int index, const Vector3& p, Best& best) const;

  const TriangleMesh& mesh_;
  const TriangleTree tree_;
  std::vector<std::array<Vector3, 3>> corners_;  // the triangles in the order of the tree
};

}  // namespace counterpoint
