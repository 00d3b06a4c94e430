// Two bodies of given shapes about to touch, for tests of contacts.
#pragma once

#include <algorithm>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene.h"
#include "support/random_model.h"
#include "support/step_derivatives.h"

namespace counterpoint::test {

inline Shape make_shape(ShapeType type) {
  Shape shape;
  shape.type = type;
  shape.size = type == ShapeType::kBox ? Vector3(0.1, 0.13, 0.17) : Vector3(0.1, 0.15, 0.0);
  if (type == ShapeType::kConvexMesh) {
    Random random(12);
    std::vector<Vector3> points;
    for (int i = 0; i < 12; ++i) points.push_back(0.15 * random.unit_vector());
    shape.mesh = make_convex_hull(points);
  }
  if (type == ShapeType::kTerrain) {  // a ridge, a hollow, and the rims
    TriangleMesh mesh;
    const double height[3] = {0.0, 0.12, -0.05};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 3; ++j)
        mesh.vertices.emplace_back(0.25 * i - 0.4, 0.3 * j - 0.3, height[(i + 2 * (j % 2)) % 3]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 2; ++j) {
        const int k = 3 * i + j;
        mesh.triangles.push_back({k, k + 3, k + 4});
        mesh.triangles.push_back({k, k + 4, k + 1});
      }
    }
    shape.terrain = make_terrain(mesh);
  }
  return shape;
}

/// Two free bodies of these shapes, or one on a tilted plane or a terrain, 0.3 mm apart or
/// overlapping by 2 mm.
inline Scene two_shapes(ShapeType a, ShapeType b, const Material& material, Random& random,
                        bool overlap) {
  ModelBuilder builder(Vector3(0.3, -0.2, -9.81));
  const ShapeType types[2] = {a, b};
  Pose X[2] = {random_pose(random, 0.0), random_pose(random, 0.0)};
  X[1].translation = 0.5 * random.unit_vector();
  if (a == ShapeType::kTerrain) {
    X[0].rotation.setIdentity();
    X[1].translation = Vector3(random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2), 0.5);
  }
  if (a == ShapeType::kPlane) X[1].translation = 0.5 * X[0].rotation.col(2);
  if (b == ShapeType::kPlane) X[1].translation = -0.5 * X[1].rotation.col(2);
  collision::Manifold manifold;
  collision::pair_contacts(make_shape(a), X[0], make_shape(b), X[1], 1.0, manifold);
  const auto nearest =
      std::min_element(manifold.points.begin(), manifold.points.begin() + manifold.size,
                       [](const auto& p, const auto& q) { return p.gap < q.gap; });
  X[1].translation -= (nearest->gap + (overlap ? 2e-3 : -3e-4)) * nearest->normal;
  for (int i = 0; i < 2; ++i) {
    if (types[i] == ShapeType::kPlane || types[i] == ShapeType::kTerrain) {
      builder.add_environment("ground", make_shape(types[i]), X[i], material);
      continue;
    }
    RobotSpec robot;
    robot.name = i == 0 ? "a" : "b";
    LinkSpec link;
    link.name = robot.name;
    link.inertia = random_inertia(random);
    link.collisions.push_back({"", Pose(), make_shape(types[i]), material});
    robot.links.push_back(link);
    builder.add_robot(robot, Base::kFloating, X[i], robot.name + "/");
  }
  Scene scene{"two shapes", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = random_vector(scene.model.nv(), random.bits(), 0.5);
  soften(scene);
  scene.options.time_step = 1e-3;
  return scene;
}

inline Material surface(double friction, double restitution, double torsion, double rolling) {
  Material m;
  m.friction = friction;
  m.restitution = restitution;
  m.torsional_friction = torsion;
  m.rolling_friction = rolling;
  return m;
}
}  // namespace counterpoint::test
