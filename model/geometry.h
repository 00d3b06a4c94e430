// Collision geometry: shapes, convex meshes, surface materials.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Which vertices of a mesh an edge joins, and where they are: list after list, for searches that
/// climb from vertex to vertex and would wait for memory wherever the next list lies.
struct VertexNeighbors {
  struct Neighbor {
    Vector3 place = Vector3::Zero();  ///< [m], as of the vertex
    int vertex = 0;
  };
  std::vector<int> begin = {0};  ///< by vertex, where its list begins in `all`, and the end
  std::vector<Neighbor> all;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const Neighbor> operator[](std::size_t vertex) const {
    return {all.data() + begin[vertex], all.data() + begin[vertex + 1]};
  }
};

/// A closed convex polyhedron. Made by make_convex_hull (mesh.h); shared between instances.
struct ConvexMesh {
  std::vector<Vector3> vertices;  ///< [m], in the geometry frame
  std::vector<std::vector<int>>
      faces;  ///< polygons (coplanar triangles merged), counter-clockwise seen from outside
  std::vector<Vector3> face_normals;  ///< unit, outward
  std::vector<double> face_offsets;   ///< [m]: normal . x = offset on the face
  VertexNeighbors vertex_neighbors;
  std::vector<std::vector<int>> vertex_faces;  ///< faces around each vertex, ascending
  /// x, y and z of the vertices, from interior_point, and of the face normals; the last one
  /// repeated up to a multiple of eight. For a look at all of them at once.
  std::array<std::vector<double>, 3> vertex_columns, normal_columns;
  Vector3 interior_point = Vector3::Zero();  ///< strictly inside (mean of the vertices)
  double radius = 0.0;         ///< largest distance of a vertex from interior_point [m]
  double volume = 0.0;         ///< of the hull [m^3]
  double source_volume = 0.0;  ///< of the mesh it was made from [m^3]; 0 if that was not closed
  double standoff = 0.0;  ///< farthest that the surface of the full hull stands off its mesh [m]
                          ///< (hull_standoff.h)
  double deviation =
      0.0;  ///< how far the full hull reaches out of this one [m]; 0: it is the full hull
  std::string source;  ///< file it came from, empty if built in memory
};

struct Terrain;

enum class ShapeType : unsigned char {
  kPlane,
  kSphere,
  kBox,
  kCapsule,
  kCylinder,
  kConvexMesh,
  kTerrain
};

/// A shape in its geometry frame G. `size` [m] holds, by type:
///   kPlane       nothing: the half-space z <= 0 of G, outward normal +z
///   kSphere      (radius, -, -)
///   kBox         half lengths along x, y, z
///   kCapsule     (radius, half length of the segment along z, -)
///   kCylinder    (radius, half length along z, -)
///   kConvexMesh  nothing: see mesh
///   kTerrain     nothing: see terrain (terrain.h); fixed to the world only
struct Shape {
  ShapeType type = ShapeType::kSphere;
  Vector3 size = Vector3::Zero();
  std::shared_ptr<const ConvexMesh> mesh;
  std::shared_ptr<const Terrain> terrain = nullptr;
};

/// Surface material. Two surfaces combine as in combine_materials.
struct Material {
  double friction = 0.8;            ///< Coulomb coefficient, sliding [-]
  double restitution = 0.0;         ///< Newton's, 0 ... 1 [-]
  double torsional_friction = 0.0;  ///< spin about the normal: torque / normal force [m]
  double rolling_friction = 0.0;    ///< rolling: torque / normal force [m]
};

/// A shape attached to a body.
struct Geometry {
  std::string name;  ///< "<link>/<collision name or index>", unique in a model
  int body = 0;      ///< index of the body it moves with; 0 is the world
  int frame =
      -1;  ///< index of the link frame it came from; -1 for environment geometry such as the ground
  int instance = -1;  ///< model instance it belongs to; -1 for environment geometry
  Pose X_BG;          ///< pose in the body frame
  Shape shape;
  Material material;
};

/// Friction and restitution of a pair: geometric mean of the frictions (MuJoCo takes the maximum,
/// Bullet the product, ODE one value a pair), larger restitution. A pair with a frictionless side
/// is frictionless.
Material combine_materials(const Material& a, const Material& b);

/// The smallest z [m] that a shape reaches when its frame G is at X_WG; -infinity for a plane.
double lowest_point(const Shape& shape, const Pose& X_WG);

}  // namespace counterpoint
