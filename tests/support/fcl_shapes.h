// Converts shapes and poses to those of the Flexible Collision Library (FCL), for comparisons in
// tests and benchmarks.
#pragma once

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <memory>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint::test {

/// Returns the same shape in the same frame; nullptr for terrain.
inline std::shared_ptr<fcl::CollisionGeometryd> fcl_geometry(const Shape& shape) {
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere:
      return std::make_shared<fcl::Sphered>(s[0]);
    case ShapeType::kBox:
      return std::make_shared<fcl::Boxd>(2.0 * s);
    case ShapeType::kCapsule:
      return std::make_shared<fcl::Capsuled>(s[0], 2.0 * s[1]);
    case ShapeType::kCylinder:
      return std::make_shared<fcl::Cylinderd>(s[0], 2.0 * s[1]);
    case ShapeType::kConvexMesh:
      break;
    case ShapeType::kTerrain:
      return nullptr;
    case ShapeType::kPlane:
      return std::make_shared<fcl::Halfspaced>(Vector3::UnitZ(), 0.0);
  }
  const ConvexMesh& mesh = *shape.mesh;
  const auto faces = std::make_shared<std::vector<int>>();
  for (const std::vector<int>& face : mesh.faces) {
    faces->push_back(static_cast<int>(face.size()));
    faces->insert(faces->end(), face.begin(), face.end());
  }
  return std::make_shared<fcl::Convexd>(std::make_shared<const std::vector<Vector3>>(mesh.vertices),
                                        static_cast<int>(mesh.faces.size()), faces, true);
}

inline fcl::Transform3d fcl_pose(const Pose& X) {
  fcl::Transform3d T = fcl::Transform3d::Identity();
  T.linear() = X.rotation;
  T.translation() = X.translation;
  return T;
}

}  // namespace counterpoint::test
