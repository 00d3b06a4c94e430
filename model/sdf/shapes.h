// <collision> of SDF files: shapes and surfaces.
#pragma once

#include <sdf/Collision.hh>
#include <sdf/Geometry.hh>
#include <sdf/Heightmap.hh>
#include <sdf/Mesh.hh>

#include "counterpoint/model/sdf/document.h"

namespace counterpoint::sdf_file {

struct CollisionRead {
  LinkSpec::Collision collision;     ///< placed in the link
  unsigned bitmask = 0xffff;         ///< touches those with which it shares a bit
  double along = 1.0, across = 1.0;  ///< friction in two directions; the material has the smaller
  sdf::ElementPtr element;
  bool touches = true;  ///< collide_without_contact
};

class ShapeReader {
 public:
  explicit ShapeReader(Document& document);
  /// `is_static`: of a model that never moves; a mesh with hollows then touches as triangles, and
  /// planes and height maps are possible. @throws InputError for shapes and surfaces that are not
  /// supported.
  CollisionRead read(const sdf::Collision& collision, bool is_static);

 private:
  /// Shape, and its frame in that of the collision.
  std::pair<Shape, Pose> shape_of(const sdf::Geometry& geometry, const sdf::ElementPtr& element,
                                  bool is_static);
  Shape mesh(const sdf::Mesh& mesh, const sdf::ElementPtr& element, bool is_static);
  Shape height_map(const sdf::Heightmap& map, const sdf::ElementPtr& element);
  void read_surface(const sdf::ElementPtr& collision, CollisionRead& out);
  void read_friction(const sdf::ElementPtr& friction, CollisionRead& out);
  std::filesystem::path find(const std::string& uri, const sdf::ElementPtr& element,
                             const char* kind);

  Document& document_;
  std::shared_ptr<HullCache> hulls_;
};

}  // namespace counterpoint::sdf_file
