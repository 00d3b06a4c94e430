// Meshes and height fields that an MJCF file names.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mjcf/document/defaults.h"

namespace counterpoint::mjcf {

/// A solid or shell of density 1.
struct MassProperties {
  double mass = 0.0;                     ///< volume [m^3], of a shell area [m^2]
  Vector3 center = Vector3::Zero();      ///< [m]
  Matrix3 rotational = Matrix3::Zero();  ///< about the centre
};

/// How the inertia of a mesh is found. kLegacy, MuJoCo's default: every triangle spans a pyramid
/// with the centre of the surface, and all count as positive. kExact: with their signs.
enum class MeshInertia { kLegacy, kExact, kConvex, kShell };
/// `kind`: kConvex is the exact one of a hull's triangles.
MassProperties mass_properties(const TriangleMesh& mesh, MeshInertia kind);

/// Files are read when they are asked for: what is only looked at is never opened.
class Assets {
 public:
  Assets(Document& document, const Defaults& defaults);

  bool has_mesh(const std::string& name) const { return meshes_.count(name) > 0; }
  /// The following @throw InputError naming `user` for unknown names and files that cannot be read.
  /// The convex hull; a hull that fills visible hollows is noted.
  std::shared_ptr<const ConvexMesh> hull(const std::string& name, const Element& user);
  MassProperties mesh_mass(const std::string& name, const Element& user);
  std::vector<Vector3> vertices(const std::string& name, const Element& user);
  std::shared_ptr<const Terrain> height_field(const std::string& name, const Element& user);

 private:
  struct Mesh {
    const Element* element = nullptr;
    std::string file;  ///< as named, with its folder; empty: vertices stand in the element
    Vector3 scale = Vector3::Ones(), reference = Vector3::Zero();
    Matrix3 turned = Matrix3::Identity();
    int max_hull_vertices = 0;
    MeshInertia inertia = MeshInertia::kLegacy;
    std::shared_ptr<const ConvexMesh> hull;
  };
  void read_mesh(const Element& element, const Values& values);
  Mesh& find(const std::string& name, const Element& user);
  /// `kind`: what messages call the file.
  std::filesystem::path path(const std::string& file, const Element& element,
                             const char* kind) const;
  TriangleMesh triangles(const Mesh& mesh) const;

  Document& document_;
  std::map<std::string, Mesh> meshes_;
  std::map<std::string, const Element*> fields_;
  std::shared_ptr<HullCache> cache_;
};

}  // namespace counterpoint::mjcf
