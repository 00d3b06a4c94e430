// Derivatives of the inverse step under closures and mimic joints, against differences.
#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "support/paths.h"
#include "support/step_derivatives.h"

namespace counterpoint::equality_derivatives_test {
namespace {

using test::expect_exact;
using test::largest;
using test::Moment;
using test::random_moment;
using test::soften;

/// Difference step of configurations [rad, m]. Biases of closures are differences of two poses over
/// the time step, so rounding counts more than elsewhere.
constexpr double kDifferenceStep = 1e-5;

test::RandomModelOptions random_options(int seed) {
  test::RandomModelOptions o;
  o.links = 2 + seed % 7;
  o.robots = 1 + seed % 3;
  o.base = seed % 2 == 0 ? Base::kFixed : Base::kFloating;
  o.fixed_share = 0.0;  // a closure must hold two bodies, not one
  o.damping = o.armature = seed % 2 == 0;
  o.limits = seed % 5 == 1;
  o.dry_friction = seed % 7 == 2;
  o.springs = seed % 4 < 2;
  o.servos = seed % 6 == 3;
  o.drag = seed % 4 == 1;
  o.compensations = seed % 4 == 2;
  return o;
}

/// A random model displaced by up to `away` [m, rad] from its default pose, where closures are
/// closed.
Scene random_scene(int seed, const test::RandomModelOptions& o, double away, test::Random& random) {
  Model model = test::make_random_model(seed, o);
  const int nv = model.nv();
  VectorX q = model.default_q();
  const VectorX shift = test::random_vector(nv, random.bits(), away);
  integrate_configuration(model, model.default_q(), shift, 1.0, q);
  VectorX v = test::random_vector(nv, random.bits());
  Scene scene{"random", std::move(model), std::move(q), std::move(v), {}};
  soften(scene);
  scene.options.time_step = seed % 3 == 1 ? 0.02 : 0.002;
  return scene;
}

TEST(EqualityDerivatives, OfRandomTreesWithMimics) {
  int mimics = 0;
  for (int seed = 0; seed < 30; ++seed) {
    test::RandomModelOptions o = random_options(seed);
    o.mimics = o.single_axis_only = true;
    test::Random random(700 + seed);
    Scene scene = random_scene(seed, o, seed % 2 ? 0.5 : 1e-3, random);
    scene.v *= seed % 8 < 6 ? 0.5 : 8.0;
    mimics += static_cast<int>(scene.model.mimics().size());
    expect_exact(scene, random_moment(scene, random, 0.1), "seed " + std::to_string(seed), false,
                 kDifferenceStep);
  }
  EXPECT_GT(mimics, 20);
}

TEST(EqualityDerivatives, OfRandomTreesWithClosures) {
  for (int seed = 0; seed < 60; ++seed) {
    test::RandomModelOptions o = random_options(seed);
    o.closures = 1 + seed % 4;
    o.mimics = seed % 5 == 4;
    test::Random random(800 + seed);
    Scene scene = random_scene(seed, o, seed % 2 ? 0.3 : 1e-4, random);
    Moment at = random_moment(scene, random, 0.1);
    if (seed % 5 == 4)
      at.known.wrenches.push_back({scene.model.num_bodies() - 1,
                                   {random.vector(2.0), random.vector(5.0)},
                                   random.vector(0.3)});
    expect_exact(scene, at, "seed " + std::to_string(seed), false, kDifferenceStep);
  }
}

/// Hinges, sliders, prismatic and cylindrical closures, springs along each axis and ropes, whether
/// or not the rigid ones are aimed.
TEST(EqualityDerivatives, OfRandomTreesWithAnyClosures) {
  int checked = 0;
  for (int seed = 0; seed < 80; ++seed) {
    test::RandomModelOptions o = random_options(seed);
    o.closures = 1 + seed % 4;
    o.any_closures = true;
    test::Random random(1100 + seed);
    Scene scene = random_scene(seed, o, seed % 2 ? 0.3 : 1e-4, random);
    const Moment at = random_moment(scene, random, 0.1);
    // A rope has a kink where it becomes taut.
    if (!test::is_smooth(scene, at, kDifferenceStep)) continue;
    ++checked;
    expect_exact(scene, at, "seed " + std::to_string(seed), false, kDifferenceStep);
  }
  EXPECT_GT(checked, 70);
}

/// The rows of a thread have no closed form, so that the whole step is differentiated by
/// differences, and says so.
TEST(EqualityDerivatives, OfScrewsAreDifferences) {
  ModelBuilder builder(Vector3(0, 0, -9.81));
  RobotSpec robot;
  robot.name = "nut";
  LinkSpec link;
  link.name = "body";
  link.inertia = {1.0, Vector3::Zero(), 0.01 * Matrix3::Identity()};
  robot.links.push_back(link);
  builder.add_robot(robot, Base::kFloating, Pose());
  ClosureSpec screw;
  screw.type = ClosureType::kScrew;
  screw.link_a = "world";
  screw.link_b = "body";
  screw.pitch = 0.1;
  builder.add_closure(screw);
  Scene scene{"screw", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(6);
  const Moment at = test::moment_of(scene, 20);
  EXPECT_FALSE(expect_exact(scene, at, "screw", true, kDifferenceStep));
}

/// Default laws, wherever no kink lies within the difference. One robot, at the origin: at 20 m,
/// positions are rounded to 4e-15 m; over a time step, times 5e6 N s/m, and over 1e-4 m/s, the
/// longest step of velocities, this is 1e-7 of du/dv+.
TEST(EqualityDerivatives, OfHardClosures) {
  int checked = 0;
  for (int seed = 0; seed < 40; ++seed) {
    test::RandomModelOptions o = random_options(seed);
    o.robots = 1;
    o.closures = 1 + seed % 4;
    o.mimics = seed % 5 == 4;
    test::Random random(800 + seed);
    Scene scene = random_scene(seed, o, seed % 2 ? 0.3 : 1e-4, random);
    scene.options.contact.smoothing = ContactOptions().smoothing;
    scene.options.contact.compliance = ContactOptions().compliance;
    const Moment at = random_moment(scene, random, 0.1);
    if (!test::is_smooth(scene, at, kDifferenceStep)) continue;
    ++checked;
    expect_exact(scene, at, "seed " + std::to_string(seed), false, kDifferenceStep);
  }
  EXPECT_GT(checked, 30);
}

/// True if this coordinate rotates bodies.
bool turns(const Model& model, int coordinate) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int j = coordinate - body.v_index;
    if (j >= 0 && j < joint_nv(body.joint_type)) return j >= joint_num_linear(body.joint_type);
  }
  return false;
}

/// At rest the engine predicts nothing, and du/dv is its limit as bodies begin to turn. Coordinates
/// that rotate no body never lead to a prediction; they are left out.
TEST(EqualityDerivatives, AtRest) {
  for (int seed = 0; seed < 12; ++seed) {
    test::RandomModelOptions o = random_options(seed);
    o.closures = seed % 3;
    o.mimics = seed % 2 == 1;
    test::Random random(900 + seed);
    Scene scene = random_scene(seed, o, 1e-4, random);
    scene.v.setZero();
    const Moment at = random_moment(scene, random, 0.05);
    Workspace ws(scene.model);
    Inverse out;
    InverseDerivatives exact, reference;
    step_inverse_derivatives(scene.model, scene.options, at.q, at.v, at.v_next, at.known, ws, out,
                             reference, DerivativeMethod::kExtrapolated, kDifferenceStep);
    step_inverse_derivatives(scene.model, scene.options, at.q, at.v, at.v_next, at.known, ws, out,
                             exact);
    EXPECT_FALSE(exact.by_differences) << seed;
    const double scale = 0.05 * largest(reference.dv_next);
    EXPECT_LE(largest(exact.dq - reference.dq),
              test::kDerivativeTolerance * (scale + largest(reference.dq)))
        << seed;
    for (int k = 0; k < scene.model.nv(); ++k) {
      if (!turns(scene.model, k)) continue;
      EXPECT_LE(largest(exact.dv.col(k) - reference.dv.col(k)),
                test::kDerivativeTolerance * (scale + largest(reference.dv)))
          << seed << ' ' << k;
    }
    EXPECT_LE(largest(exact.dv_next - reference.dv_next),
              test::kDerivativeTolerance * largest(reference.dv_next))
        << seed;
  }
}

struct BundledCase {
  const char* name;
  int steps;
};

TEST(EqualityDerivatives, OfBundledScenes) {
  const BundledCase cases[] = {
      {"closures", 0},     {"closures", 20},        {"closures", 600},         {"everything", 0},
      {"everything", 150}, {"hard/four_bar", 100},  {"hard/slider_crank", 50}, {"hard/bricard", 40},
      {"hard/crane", 30},  {"hard/hung_chain", 40}, {"hard/geared", 60}};
  for (const BundledCase& c : cases) {
    Scene scene = load_scene(std::filesystem::path(test::source_dir()) / "data/scenes" /
                             (std::string(c.name) + ".yaml"));
    soften(scene);
    const Moment at = test::moment_of(scene, c.steps);
    expect_exact(scene, at, std::string(c.name) + " " + std::to_string(c.steps), false,
                 kDifferenceStep);
  }
}

TEST(EqualityDerivatives, ByTheVelocityAtTheEndAreSymmetric) {
  test::RandomModelOptions o;
  o.links = 6;
  o.robots = 2;
  o.fixed_share = 0.0;
  o.closures = 3;
  o.mimics = true;
  test::Random random(5);
  const Scene scene = random_scene(5, o, 1e-3, random);
  const Moment at = random_moment(scene, random, 0.05);
  Workspace ws(scene.model);
  Inverse out;
  InverseDerivatives d;
  step_inverse_derivatives(scene.model, scene.options, at.q, at.v, at.v_next, at.known, ws, out, d);
  ASSERT_EQ(out.closures.size(), 3u);
  // Rounding of products of six numbers.
  EXPECT_LE(largest(d.dv_next - d.dv_next.transpose()), 1e-12 * largest(d.dv_next));
}

}  // namespace
}  // namespace counterpoint::equality_derivatives_test
