// How often a mesh winds around a point, which tells inside from outside also where the mesh is
// open or crosses itself (Barill et al., "Fast winding numbers for soups and clouds", 2018).
#pragma once

#include <cstdint>
#include <vector>

#include "counterpoint/model/mesh/nearest_triangle.h"

namespace counterpoint {

/// Winding numbers of a mesh, which must outlive it, as `nearest`, its search. For one thread.
class WindingNumber {
 public:
  /// opening: width of openings [m] through which the outside reaches into hollows; narrower ones,
  /// and hollows that are closed, count as inside where the lattice below is fine enough.
  /// hollows: of nearly the same mesh, decides which hollows are inside; null: as just said.
  WindingNumber(const TriangleMesh& mesh, const NearestTriangle& nearest, double opening,
                const WindingNumber* hollows = nullptr);

  /// Returns the sum of the triangles' solid angles seen from p, over 4 pi: 1 inside and 0 outside
  /// of a closed mesh. Far triangles count by their sum of area vectors; the error is below 0.2
  /// near a mesh, far from 1/2.
  double at(const Vector3& p) const { return at(0, p); }
  /// True inside, whichever way the triangles face, and in hollows that the outside does not
  /// reach. Within a cube of a lattice that the mesh does not touch, the cube's middle decides, and
  /// is remembered.
  bool inside(const Vector3& p) const;

 private:
  /// The triangles of a node of the tree, as one area vector at a point.
  struct Cluster {
    Vector3 area = Vector3::Zero(), center = Vector3::Zero();
    double total = 0.0;   // sum of the areas [m^2]
    double radius = 0.0;  // radius of a ball about `center` with all triangles [m]
  };
  Cluster gather(int index);
  double at(int index, const Vector3& p) const;

  /// State of a cube. kFree: outside by its winding number, perhaps in a closed hollow; kSeen:
  /// while that is explored.
  enum Known : std::uint8_t { kUnknown, kFree, kOutside, kInside, kTouched, kSeen };
  bool has(const Eigen::Array3i& cube) const;
  Known& known_at(const Eigen::Array3i& cube) const;
  std::size_t index_of(const Eigen::Array3i& cube) const;
  Vector3 middle_of(const Eigen::Array3i& cube) const;
  /// True if a ball as wide as a passage gets from p straight out along an axis.
  bool leads_out(Vector3 p, int face) const;
  /// Decides whether a free cube is outside or in a closed hollow, with those connected to it.
  void explore(const Eigen::Array3i& from) const;

  const TriangleMesh& mesh_;
  const WindingNumber* hollows_;
  const NearestTriangle& nearest_;
  const TriangleTree& tree_;
  std::vector<Cluster> clusters_;     // for each node
  double cube_;                       // edge of a cube [m]
  bool fills_;                        // hollows that are closed are inside
  Eigen::Array3i count_;              // numbers of cubes
  mutable std::size_t explored_ = 0;  // number of cubes in hollows that were explored
  mutable std::vector<Known> known_;  // for each cube
};

}  // namespace counterpoint
