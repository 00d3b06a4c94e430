// Derivatives of the inverse step of random trees with shapes on their links over a ground: every
// joint type with every effect at once, some effects switched off.
#include <gtest/gtest.h>

#include "support/two_shapes.h"

namespace counterpoint::tree_contact_derivatives_test {
namespace {

using test::expect_exact;
using test::Moment;
using test::surface;
using enum ShapeType;

RobotSpec make_robot(int seed, const test::RandomModelOptions& o, test::Random& random) {
  constexpr ShapeType kShapes[] = {kSphere, kCapsule, kBox, kCylinder, kConvexMesh};
  RobotSpec robot = test::make_random_robot(seed, o);
  for (LinkSpec& link : robot.links) {
    const Material material = surface(random.uniform(0.2, 1.0), seed % 3 == 0 ? 0.3 : 0.0,
                                      seed % 4 == 0 ? 0.02 : 0.0, seed % 8 == 0 ? 0.01 : 0.0);
    link.collisions.push_back({"", test::random_pose(random, 0.1),
                               test::make_shape(kShapes[random.integer(0, 4)]), material});
  }
  for (JointSpec& joint : robot.joints)
    if (seed % 3 == 1) joint.velocity_limit = random.uniform(0.3, 1.0);
  return robot;
}

/// Some links overlap the ground, some overlap each other.
Scene make_scene(int seed, const test::RandomModelOptions& o, test::Random& random) {
  const RobotSpec robot = make_robot(seed, o, random);
  ModelBuilder floating;
  floating.add_robot(robot, o.base, Pose(), "");
  const Model in_the_air = floating.build();
  VectorX q = test::random_configuration(in_the_air, random.bits());
  double lowest = 0.0;
  for (const Pose& X : body_poses(in_the_air, q)) lowest = std::min(lowest, X.translation.z());
  ModelBuilder builder;
  builder.add_robot(robot, o.base, Pose(), "");
  Pose X_WG;
  X_WG.translation.z() = lowest - 0.1;
  builder.add_environment("ground", test::make_shape(kPlane), X_WG, surface(0.7, 0.0, 0.0, 0.0));
  Model model = builder.build();
  VectorX v = test::random_vector(model.nv(), random.bits(), 0.3);
  Scene scene{"crowded", std::move(model), std::move(q), std::move(v), {}};
  test::soften(scene);
  scene.options.time_step = 1e-3;
  scene.options.effects.set(Effect::kVelocityLimits, true);
  scene.options.contact.friction_model = static_cast<FrictionModel>(seed % 3);
  scene.options.mean_velocity_forces = seed % 4 != 3;
  if (seed % 7 == 3) scene.options.effects.set(Effect::kGravity, false);
  if (seed % 7 == 5) scene.options.effects.set(Effect::kCoriolis, false);
  if (seed % 7 == 6) scene.options.effects.set(Effect::kFriction, false);
  return scene;
}

TEST(TreeContactDerivatives, OfEveryJointTypeWithEveryEffect) {
  int contacts = 0, checked = 0;
  for (int seed = 0; seed < 44; ++seed) {
    test::RandomModelOptions o;
    o.links = 2 + seed % 6;
    o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
    o.fixed_share = 0.0;
    o.damping = o.armature = seed % 2 == 0;
    o.limits = seed % 5 == 1;
    o.dry_friction = seed % 7 == 2;
    o.springs = seed % 4 < 2;
    o.servos = o.effort_limits = seed % 6 == 3;
    o.drag = seed % 4 == 1;
    o.compensations = seed % 4 == 2;
    o.mimics = seed % 5 == 4;
    test::Random random(2100 + seed);
    const Scene scene = make_scene(seed, o, random);
    Moment at = test::random_moment(scene, random, 0.03);
    if (seed % 5 == 3)
      at.known.wrenches.push_back({scene.model.num_bodies() - 1,
                                   {random.vector(2.0), random.vector(5.0)},
                                   random.vector(0.3)});
    // Difference step of contact_derivatives_test.cc.
    constexpr double kStep = 2e-8;
    if (!test::is_smooth(scene, at, kStep)) continue;
    Workspace ws(scene.model);
    Inverse out;
    step_inverse(scene.model, scene.options, at.q, at.v, at.v_next, at.known, ws, out);
    contacts += static_cast<int>(out.contacts.size());
    ++checked;
    expect_exact(scene, at, "seed " + std::to_string(seed), seed % 3 == 0,
                 kStep);  // bounces
  }
  EXPECT_GT(contacts, 60);
  EXPECT_GT(checked, 30);
}

}  // namespace
}  // namespace counterpoint::tree_contact_derivatives_test
