// The nearest triangle of a mesh, by a tree of bounding boxes.
#pragma once

#include <limits>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// Finds nearest triangles of a mesh, which must outlive it.
class NearestTriangle {
 public:
  explicit NearestTriangle(const TriangleMesh& mesh)
      : mesh_(mesh), tree_(mesh.vertices, mesh.triangles) {}

  struct Answer {
    double distance = std::numeric_limits<double>::infinity();  ///< [m]
    int triangle = -1;
  };
  /// `guess`: index of a triangle that may be near, or -1.
  Answer find(const Vector3& p, int guess = -1) const;
  /// Returns the distance of a point from one triangle [m].
  double distance(const Vector3& p, int triangle) const;

 private:
  void search(int index, const Vector3& p, Answer& best) const;

  const TriangleMesh& mesh_;
  const TriangleTree tree_;
};

}  // namespace counterpoint
