// <collision> of SDF files: shapes and surfaces.
#pragma once

#include <sdf/Collision.hh>
#include <sdf/Geometry.hh>
#include <sdf/Heightmap.hh>
#include <sdf/Mesh.hh>
#include <sdf/Model.hh>

#include "counterpoint/model/sdf/document.h"

namespace counterpoint::sdf_file {

struct CollisionRead {
  LinkSpec::Collision collision;     ///< pose in the link frame
  unsigned bitmask = 0xffff;         ///< collides with masks that share a bit
  double along = 1.0, across = 1.0;  ///< friction in two directions; material has the smaller
  sdf::ElementPtr element;
  bool touches = true;  ///< false: collide_without_contact, or an empty mask
  /// Inertia of the solid that the shape bounds, in the link frame; zero for planes and height
  /// maps.
  SpatialInertia inertia;
};

class ShapeReader {
 public:
  explicit ShapeReader(Document& document);
  /// Makes the hulls of the models' meshes on all processors. One that fails is left to read().
  void load_ahead(const std::vector<const sdf::Model*>& models);
  /// `is_static`: the model never moves; then a mesh with hollows collides as triangles, and planes
  /// and height maps are allowed. @throws InputError for shapes and surfaces that are not
  /// supported.
  /// density: of the solid, where the collision gives none [kg/m^3]; nothing: no inertia is wanted.
  CollisionRead read(const sdf::Collision& collision, bool is_static,
                     const std::optional<double>& density);

 private:
  /// The shape and its pose in the collision frame.
  std::pair<Shape, Pose> shape_of(const sdf::Geometry& geometry, const sdf::ElementPtr& element,
                                  bool is_static);
  Shape mesh(const sdf::Mesh& mesh, const sdf::ElementPtr& element, bool is_static);
  std::optional<MeshCollision> collision_of(const sdf::ElementPtr& collision);
  HullCache::MeshFile mesh_file(const std::filesystem::path& file, const sdf::Mesh& mesh,
                                const sdf::ElementPtr& element, bool is_static);
  /// Lists the meshes of a model and of those within it.
  void list_meshes(const sdf::Model& model, bool is_static, std::vector<HullCache::MeshFile>& out);
  /// The solid of density 1 in the collision frame; X_CS: pose of the shape there.
  SpatialInertia unit_inertia(const sdf::Geometry& geometry, const sdf::ElementPtr& element,
                              const Shape& shape, const Pose& X_CS);
  Shape height_map(const sdf::Heightmap& map, const sdf::ElementPtr& element);
  void read_surface(const sdf::ElementPtr& collision, CollisionRead& out);
  void read_friction(const sdf::ElementPtr& friction, CollisionRead& out);
  void read_stiffness(const sdf::ElementPtr& ode, Material& material);
  MeshPath path_of(const std::string& uri, const sdf::ElementPtr& element, const char* kind) const;
  /// The same file; notes if it was guessed.
  std::filesystem::path find(const std::string& uri, const sdf::ElementPtr& element,
                             const char* kind);

  Document& document_;
  std::shared_ptr<HullCache> hulls_;
};

}  // namespace counterpoint::sdf_file
