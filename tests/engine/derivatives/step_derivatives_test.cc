// Derivatives of the inverse step: against differences of the whole step, and by properties that
// hold in every scene.
#include "support/step_derivatives.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/derivatives.h"
#include "support/paths.h"
#include "support/small_scenes.h"
#include "support/two_shapes.h"

namespace counterpoint::step_derivatives_test {
namespace {

using test::expect_exact;
using test::largest;
using test::Moment;
using test::random_moment;
using test::soften;
using test::surface;
using test::two_shapes;
using enum ShapeType;

struct Drawn {
  Scene scene;
  Moment at;
};

/// A random tree with every joint force, and a random step from it.
Drawn draw(int seed, bool hard) {
  test::RandomModelOptions o;
  o.links = 1 + seed % 9;
  o.robots = 1 + seed % 2;
  o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
  o.damping = o.armature = seed % 2 == 0;
  o.limits = seed % 5 == 1;
  o.dry_friction = seed % 7 == 2;
  o.springs = seed % 4 < 2;
  o.servos = o.effort_limits = seed % 6 == 3;
  o.drag = seed % 4 == 1;
  o.compensations = seed % 4 == 2;
  test::Random random(500 + seed);
  Scene scene = test::make_random_scene(seed, o, random);
  if (!hard) soften(scene);
  // Slow trees, and trees fast enough for energy projection (energy_projection.h).
  scene.v *= seed % 8 < 4 ? 0.5 : 3.0;
  scene.options.time_step = seed % 3 == 1 ? 0.02 : 0.002;
  Moment at = random_moment(scene, random, 0.1);
  if (seed % 5 == 4)
    at.known.wrenches.push_back({scene.model.num_bodies() - 1,
                                 {random.vector(2.0), random.vector(5.0)},
                                 random.vector(0.3)});
  return {std::move(scene), std::move(at)};
}

TEST(InverseDerivatives, OfRandomTreesWithEveryJointForce) {
  for (int seed = 0; seed < 40; ++seed) {
    const Drawn drawn = draw(seed, false);
    expect_exact(drawn.scene, drawn.at, "seed " + std::to_string(seed), false, 4e-5);
  }
}

/// Default laws, wherever no kink lies within the difference.
TEST(InverseDerivatives, OfRandomTreesWithHardJointForces) {
  int checked = 0;
  for (int seed = 0; seed < 60; ++seed) {
    const Drawn drawn = draw(seed, true);
    constexpr double kStep = 4e-5;
    if (!test::is_smooth(drawn.scene, drawn.at, kStep)) continue;
    ++checked;
    expect_exact(drawn.scene, drawn.at, "seed " + std::to_string(seed), false, kStep);
  }
  EXPECT_GT(checked, 45);
}

/// Trees with both a velocity prediction and energy projection (energy_projection.h). They turn by
/// 0.026 to 0.08 rad a step, where the pose at which energy is kept changes (kFarTurn).
TEST(InverseDerivatives, OfProjectedTreesWithAPrediction) {
  int kept = 0;
  for (int seed = 0; seed < 24; ++seed) {
    test::RandomModelOptions o;
    o.links = 2 + seed % 5;
    o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
    o.armature = o.damping = seed % 2 == 0;
    test::Random random(300 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    scene.options.time_step = 0.002;
    Workspace ws(scene.model);
    const Moment slow = random_moment(scene, random, 0.0);
    Inverse out;
    step_inverse(scene.model, scene.options, slow.q, slow.v, slow.v_next, ws, out);
    double fastest = 0.0;
    for (const Motion& V : ws.impl().start.kinematics().V)
      fastest = std::max(fastest, V.angular.norm());
    if (!(fastest > 0.1)) continue;  // prismatic joints only
    scene.v *= random.uniform(13.0, 40.0) / fastest;
    const Moment at = random_moment(scene, random, 0.1);
    step_inverse(scene.model, scene.options, at.q, at.v, at.v_next, ws, out);
    for (int t = 0; t < scene.model.num_trees(); ++t)
      kept += ws.impl().start.predictor().covers(t) &&
              ws.impl().start.energy_projection().share(t) > 0.0;
    expect_exact(scene, at, "seed " + std::to_string(seed), false, 1e-5);
  }
  EXPECT_GT(kept, 15);
}

/// Scenes of data/scenes, softened, after `steps` steps. Boxes flush on each other are left out;
/// closures: equality_derivatives_test.cc.
TEST(InverseDerivatives, OfBundledScenes) {
  struct Case {
    const char* name;
    int steps;
    double time_step;
  };
  const Case cases[] = {{"arm7", 160, 0.002},           {"arm7", 30, 0.03},
                        {"arm7_servo", 60, 0.002},      {"coin_spin", 120, 0.002},
                        {"cube_drop", 250, 0.002},      {"cube_toss", 150, 0.0},
                        {"double_pendulum", 60, 0.03},  {"pendulum", 100, 0.002},
                        {"humanoid_drop", 400, 0.002},  {"humanoid_drop", 15, 0.03},
                        {"quadruped_drop", 150, 0.002}, {"terrain", 150, 0.002},
                        {"terrain", 400, 0.002},        {"terrain", 900, 0.002}};
  for (const Case& c : cases) {
    Scene scene = load_scene(std::filesystem::path(test::source_dir()) / "data/scenes" /
                             (std::string(c.name) + ".yaml"));
    soften(scene);
    if (c.time_step > 0.0) scene.options.time_step = c.time_step;
    // Four equal feet would slide equally fast, and the fastest contact would not be unique.
    if (std::string(c.name) == "quadruped_drop") scene.v[3] = 0.2;
    expect_exact(scene, test::moment_of(scene, c.steps),
                 std::string(c.name) + " " + std::to_string(c.time_step), false, 1e-6);
  }
}

/// All three matrices of the implicit midpoint rule without constraints, a smooth function.
TEST(InverseDerivatives, OfTheMidpointRule) {
  for (int seed = 0; seed < 20; ++seed) {
    test::RandomModelOptions o;
    o.links = 1 + seed % 8;
    o.robots = 1 + seed % 2;
    o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
    o.damping = o.armature = seed % 2 == 0;
    o.springs = seed % 4 < 2;
    o.servos = seed % 6 == 3;
    o.drag = seed % 4 == 1;
    test::Random random(600 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    scene.options.integrator = Integrator::kImplicitMidpoint;
    scene.options.time_step = seed % 3 == 1 ? 0.05 : 0.002;
    Moment at = random_moment(scene, random, 0.1);
    if (seed % 5 == 4)
      at.known.wrenches.push_back({scene.model.num_bodies() - 1,
                                   {random.vector(2.0), random.vector(5.0)},
                                   random.vector(0.3)});
    expect_exact(scene, at, "seed " + std::to_string(seed), false, 1e-4);
  }
}

TEST(InverseDerivatives, ByTheVelocityAtTheEndAreSymmetricOfConvexLaws) {
  test::Random random(3);
  for (const FrictionModel friction : {FrictionModel::kConvex, FrictionModel::kLagged}) {
    Scene scene = two_shapes(kPlane, kCapsule, surface(0.5, 0.2, 0.01, 0.01), random, true);
    scene.options.contact.friction_model = friction;
    const Moment at = random_moment(scene, random, 0.05);
    Workspace ws(scene.model);
    Inverse out;
    InverseDerivatives d;
    step_inverse_derivatives(scene.model, scene.options, at.q, at.v, at.v_next, at.known, ws, out,
                             d);
    ASSERT_FALSE(out.contacts.empty());
    // Rounding of products of six numbers.
    EXPECT_LE(largest(d.dv_next - d.dv_next.transpose()), 1e-13 * largest(d.dv_next));
  }
}

/// Scaling all masses, and with them the contact laws, by s scales forces and derivatives by s.
TEST(InverseDerivatives, ScaleWithMass) {
  constexpr double kScale = 7.0;
  InverseDerivatives d[2];
  for (const int heavy : {0, 1}) {
    Scene scene = test::box_on_plane({.mass = heavy ? kScale : 1.0, .height = -1e-4});
    soften(scene);
    scene.v << 0.2, -0.1, -0.3, 1.0, 0.5, -0.4;
    const VectorX v_next = scene.v + VectorX::Constant(6, 0.03);
    Workspace ws(scene.model);
    Inverse out;
    step_inverse_derivatives(scene.model, scene.options, scene.q, scene.v, v_next, Input(), ws, out,
                             d[heavy]);
    ASSERT_FALSE(out.contacts.empty());
  }
  // Rounding, also of the weights, which are sums over a body's corners.
  EXPECT_LE(largest(d[1].dq - kScale * d[0].dq), 1e-11 * largest(d[1].dq));
  EXPECT_LE(largest(d[1].dv - kScale * d[0].dv), 1e-11 * largest(d[1].dv));
  EXPECT_LE(largest(d[1].dv_next - kScale * d[0].dv_next), 1e-11 * largest(d[1].dv_next));
}

}  // namespace
}  // namespace counterpoint::step_derivatives_test
