// Meshes and height fields of an MJCF file (<asset>).
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/mesh_mass.h"
#include "counterpoint/model/mjcf/document/defaults.h"

namespace counterpoint::mjcf {

/// Opens an asset's file when the asset is first used; meshes for display only are never opened.
class Assets {
 public:
  Assets(Document& document, const Defaults& defaults);

  bool has_mesh(const std::string& name) const { return meshes_.count(name) > 0; }
  /// The functions below @throw InputError naming `user` for unknown names and files that cannot be
  /// read. hull() returns the convex hull and notes a hull that fills visible hollows.
  std::shared_ptr<const ConvexMesh> hull(const std::string& name, const Element& user);
  MassProperties mesh_mass(const std::string& name, const Element& user);
  TriangleMesh triangles(const std::string& name, const Element& user);
  std::shared_ptr<const Terrain> height_field(const std::string& name, const Element& user);
  /// Makes the hulls of meshes on all processors. One that fails is left to hull().
  void load_ahead(const std::vector<std::string>& names);

 private:
  struct Mesh {
    const Element* element = nullptr;
    std::string file;  ///< name in the asset, with its folder; empty: vertices are given
    Vector3 scale = Vector3::Ones(), reference = Vector3::Zero();
    Matrix3 turned = Matrix3::Identity();
    int max_hull_vertices = 0;
    MeshInertia inertia = MeshInertia::kLegacy;
    std::shared_ptr<const ConvexMesh> hull;
  };
  void read_mesh(const Element& element, const Values& values);
  Mesh& find(const std::string& name, const Element& user);
  /// `kind`: noun for the file in messages, for example "mesh".
  std::filesystem::path path(const std::string& file, const Element& element,
                             const char* kind) const;
  TriangleMesh triangles(const Mesh& mesh) const;
  /// The file of a mesh that collides as it stands there; nothing with refpos or refquat, or for
  /// MSH files and given vertices.
  std::optional<HullCache::MeshFile> plain_file(const Mesh& mesh) const;

  Document& document_;
  std::map<std::string, Mesh> meshes_;
  std::map<std::string, const Element*> fields_;
  std::shared_ptr<HullCache> cache_;
};

}  // namespace counterpoint::mjcf
