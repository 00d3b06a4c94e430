// Derivatives of the inverse of implicit midpoint steps with constraints, against its differences.
// Derivatives of the forward step: forward_derivatives_test.cc.
#include <gtest/gtest.h>

#include "support/two_shapes.h"

namespace counterpoint::midpoint_derivatives_test {
namespace {

using test::expect_exact;
using test::Moment;
using test::soften;
using test::step_moment;
using test::surface;
using test::two_shapes;
using enum ShapeType;

Input random_input(const Model& model, test::Random& random) {
  Input input;
  input.applied_force = test::random_vector(model.nv(), random.bits(), 2.0);
  input.wrenches.push_back(
      {model.num_bodies() - 1, {random.vector(2.0), random.vector(5.0)}, random.vector(0.3)});
  return input;
}

TEST(MidpointDerivatives, OfRandomTreesWithJointRows) {
  for (int seed = 0; seed < 24; ++seed) {
    test::RandomModelOptions o;
    o.links = 2 + seed % 7;
    o.robots = 1 + seed % 2;
    o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
    o.damping = o.armature = seed % 2 == 0;
    o.limits = seed % 3 != 1;
    o.dry_friction = seed % 3 != 0;
    o.springs = seed % 4 < 2;
    o.servos = seed % 6 == 3;
    o.drag = seed % 4 == 1;
    o.compensations = seed % 4 == 2;
    test::Random random(1100 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    soften(scene);
    scene.options.integrator = Integrator::kImplicitMidpoint;
    scene.options.time_step = seed % 3 == 1 ? 0.005 : 0.002;
    scene.v *= 0.5;
    const Moment at = step_moment(scene, random_input(scene.model, random));
    expect_exact(scene, at, "seed " + std::to_string(seed), false, 1e-5);
  }
}

TEST(MidpointDerivatives, OfShapesThatTouch) {
  const Material materials[] = {surface(0.6, 0.0, 0.0, 0.0), surface(0.6, 0.4, 0.02, 0.01)};
  int contacts = 0;
  for (const auto& [a, b] : {std::pair(kPlane, kBox), std::pair(kPlane, kCapsule),
                             std::pair(kSphere, kCapsule), std::pair(kBox, kConvexMesh)}) {
    for (const FrictionModel friction :
         {FrictionModel::kCoulomb, FrictionModel::kConvex, FrictionModel::kLagged}) {
      for (const Material& material : materials) {
        test::Random random(1200 + contacts);
        Scene scene = two_shapes(a, b, material, random, contacts % 2 == 0);
        scene.options.integrator = Integrator::kImplicitMidpoint;
        scene.options.contact.friction_model = friction;
        const Moment at = step_moment(scene, random_input(scene.model, random));
        Workspace ws(scene.model);
        Inverse out;
        step_inverse(scene.model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                     out);
        contacts += static_cast<int>(out.contacts.size());
        expect_exact(
            scene, at,
            std::to_string(static_cast<int>(b)) + " " + std::to_string(static_cast<int>(friction)),
            material.restitution > 0.0, 2e-8);
      }
    }
  }
  EXPECT_GT(contacts, 24);
}

/// With closures the derivatives have no closed form. The result reports differences, and
/// forward_derivatives_test.cc checks them as the inverse of those of the forward step.
TEST(MidpointDerivatives, OfTiesAreSaidToBeDifferences) {
  test::RandomModelOptions o;
  o.links = 5;
  o.fixed_share = 0.0;
  o.closures = 1;
  Scene scene{"random", test::make_random_model(4, o), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = test::random_vector(scene.model.nv(), 3, 0.5);
  soften(scene);
  scene.options.integrator = Integrator::kImplicitMidpoint;
  EXPECT_FALSE(expect_exact(scene, step_moment(scene, Input()), "closure", true));
}

}  // namespace
}  // namespace counterpoint::midpoint_derivatives_test
