// Derivatives of the inverse step and of the forward step: against differences of the whole steps,
// and what they must be whatever the scene.
#include "counterpoint/engine/step_derivatives.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/engine/integrator.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step_workspace.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint {
namespace {

/// Of the largest entry. The reference, extrapolated differences, is right to about 1e-9 of it.
constexpr double kTolerance = 1e-7;

double largest(const MatrixX& m) { return m.size() ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Where speeds are scaled to keep energy, rounding alone ends the search: steps leave 1e-7, which
/// differences would see.
void sharpen(Workspace& ws) { ws.impl().fast_trees.set_tolerance(1e-15); }

/// A moment of a scene and where it leads.
struct Moment {
  VectorX q, v, v_next;
  Input known;
};

/// may_differ: what acts may have no closed form. Returns whether it has.
bool expect_exact(const Scene& scene, const Moment& at, const std::string& what,
                  bool may_differ = false, double difference_step = 0.0) {
  const Model& model = scene.model;
  Workspace ws(model);
  sharpen(ws);
  Inverse out;
  InverseDerivatives exact, reference;
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.v_next, at.known, ws, out,
                           reference, DerivativeMethod::kExtrapolated, difference_step);
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.v_next, at.known, ws, out, exact);
  EXPECT_TRUE(may_differ || !exact.by_differences) << what;
  // An entry may vanish altogether: of a body without forces, say. M / h is there always.
  const double scale = largest(reference.dv_next) * 0.05;
  // Two differences with steps of their own differ by their rounding.
  if (!exact.by_differences) {
    EXPECT_LE(largest(exact.dq - reference.dq), kTolerance * (scale + largest(reference.dq)))
        << what;
    EXPECT_LE(largest(exact.dv - reference.dv), kTolerance * (scale + largest(reference.dv)))
        << what;
  }
  EXPECT_LE(largest(exact.dv_next - reference.dv_next), kTolerance * largest(reference.dv_next))
      << what;
  const std::size_t before = test::allocation_count();
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.v_next, at.known, ws, out, exact);
  EXPECT_EQ(test::allocation_count(), before) << what;
  return !exact.by_differences;
}

/// Wide enough that no kink lies within a difference.
void soften(Scene& scene) {
  scene.options.contact.smoothing = 1e-3;
  scene.options.contact.compliance = 1e-2;
}

Moment random_moment(const Scene& scene, test::Random& random, double change) {
  const int nv = scene.model.nv();
  Moment at{scene.q, scene.v, {}, {}};
  at.v_next = at.v + test::random_vector(nv, random.bits(), change);
  return at;
}

TEST(InverseDerivatives, OfRandomTreesWithEveryJointForce) {
  for (int seed = 0; seed < 40; ++seed) {
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
    test::Random random(500 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    soften(scene);
    // Slow ones, and such as the energy of is kept of (fast_trees.h).
    scene.v *= seed % 8 < 4 ? 0.5 : 3.0;
    scene.options.time_step = seed % 3 == 1 ? 0.02 : 0.002;
    Moment at = random_moment(scene, random, 0.1);
    if (seed % 5 == 4)
      at.known.wrenches.push_back({scene.model.num_bodies() - 1,
                                   {random.vector(2.0), random.vector(5.0)},
                                   random.vector(0.3)});
    expect_exact(scene, at, "seed " + std::to_string(seed), false, 4e-5);
  }
}

Shape make_shape(ShapeType type) {
  Shape shape;
  shape.type = type;
  shape.size = type == ShapeType::kBox ? Vector3(0.1, 0.13, 0.17) : Vector3(0.1, 0.15, 0.0);
  return shape;
}

/// Two free bodies of these shapes, or one on a plane that leans, a few millimetres apart or
/// overlapping.
Scene two_shapes(ShapeType a, ShapeType b, const Material& material, test::Random& random,
                 bool overlap) {
  ModelBuilder builder(Vector3(0.3, -0.2, -9.81));
  const ShapeType types[2] = {a, b};
  Pose X[2] = {test::random_pose(random, 0.0), test::random_pose(random, 0.0)};
  X[1].translation = 0.5 * random.unit_vector();
  if (a == ShapeType::kPlane) X[1].translation = 0.5 * X[0].rotation.col(2);
  if (b == ShapeType::kPlane) X[1].translation = -0.5 * X[1].rotation.col(2);
  collision::Manifold manifold;
  collision::pair_contacts(make_shape(a), X[0], make_shape(b), X[1], 1.0, manifold);
  const auto nearest =
      std::min_element(manifold.points.begin(), manifold.points.begin() + manifold.size,
                       [](const auto& p, const auto& q) { return p.gap < q.gap; });
  X[1].translation -= (nearest->gap + (overlap ? 2e-3 : -3e-4)) * nearest->normal;
  for (int i = 0; i < 2; ++i) {
    if (types[i] == ShapeType::kPlane) {
      builder.add_environment("ground", make_shape(types[i]), X[i], material);
      continue;
    }
    RobotSpec robot;
    robot.name = i == 0 ? "a" : "b";
    LinkSpec link;
    link.name = robot.name;
    link.inertia = test::random_inertia(random);
    link.collisions.push_back({"", Pose(), make_shape(types[i]), material});
    robot.links.push_back(link);
    builder.add_robot(robot, Base::kFloating, X[i], robot.name + "/");
  }
  Scene scene{"two shapes", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = test::random_vector(scene.model.nv(), random.bits(), 0.5);
  soften(scene);
  // Bodies that move little within a step have the contacts of their pose alone.
  scene.options.time_step = 1e-3;
  return scene;
}

struct Law {
  const char* name;
  FrictionModel model;
  Material material;
};
Material surface(double friction, double restitution, double torsion, double rolling) {
  Material m;
  m.friction = friction;
  m.restitution = restitution;
  m.torsional_friction = torsion;
  m.rolling_friction = rolling;
  return m;
}
const Law kLaws[] = {
    {"frictionless", FrictionModel::kCoulomb, surface(0.0, 0.0, 0.0, 0.0)},
    {"coulomb", FrictionModel::kCoulomb, surface(0.6, 0.0, 0.0, 0.0)},
    {"coulomb, restitution", FrictionModel::kCoulomb, surface(0.6, 0.5, 0.0, 0.0)},
    {"coulomb, torsion", FrictionModel::kCoulomb, surface(0.6, 0.0, 0.02, 0.0)},
    {"coulomb, rolling", FrictionModel::kCoulomb, surface(0.6, 0.2, 0.02, 0.01)},
    {"convex", FrictionModel::kConvex, surface(0.6, 0.3, 0.0, 0.0)},
    {"convex, rolling", FrictionModel::kConvex, surface(0.6, 0.0, 0.02, 0.01)},
    {"lagged", FrictionModel::kLagged, surface(0.6, 0.0, 0.0, 0.0)},
    {"lagged, rolling", FrictionModel::kLagged, surface(0.6, 0.5, 0.02, 0.01)},
};

/// Pairs whose contacts may be those of the poses that their motion leads to (pair_motion.h).
bool may_look_ahead(ShapeType a, ShapeType b) {
  const auto round = [](ShapeType t) {
    return t == ShapeType::kSphere || t == ShapeType::kCapsule;
  };
  return a != ShapeType::kPlane && b != ShapeType::kPlane && !(round(a) && round(b));
}

class ShapePair : public ::testing::TestWithParam<std::pair<ShapeType, ShapeType>> {};

TEST_P(ShapePair, OfEveryLaw) {
  const auto [a, b] = GetParam();
  int contacts = 0, closed = 0;
  for (const Law& law : kLaws) {
    for (int seed = 0; seed < 6; ++seed) {
      test::Random random(900 + seed);
      Scene scene = two_shapes(a, b, law.material, random, seed % 2 == 0);
      scene.options.contact.friction_model = law.model;
      Moment at = random_moment(scene, random, 0.05);
      Workspace ws(scene.model);
      Inverse out;
      step_inverse(scene.model, scene.options, at.q, at.v, at.v_next, ws, out);
      contacts += static_cast<int>(out.contacts.size());
      // Some thousandth of the speed over which laws bend, sqrt(4 r k), times the time step.
      closed += expect_exact(scene, at, std::string(law.name) + " " + std::to_string(seed),
                             may_look_ahead(a, b), 2e-8);
    }
  }
  EXPECT_GT(contacts, 9);
  EXPECT_GT(closed, 9);
}

using enum ShapeType;
INSTANTIATE_TEST_SUITE_P(Shapes, ShapePair,
                         ::testing::Values(std::pair(kPlane, kSphere), std::pair(kPlane, kBox),
                                           std::pair(kPlane, kCapsule),
                                           std::pair(kPlane, kCylinder), std::pair(kSphere, kPlane),
                                           std::pair(kCapsule, kPlane), std::pair(kSphere, kSphere),
                                           std::pair(kSphere, kBox), std::pair(kSphere, kCapsule),
                                           std::pair(kSphere, kCylinder),
                                           std::pair(kCapsule, kCapsule), std::pair(kBox, kCapsule),
                                           std::pair(kBox, kBox)));

/// Scenes of data/scenes, softened, after so many steps. Boxes flush on each other and closures
/// stand apart.
TEST(InverseDerivatives, OfBundledScenes) {
  struct Case {
    const char* name;
    int steps;
    double time_step;
  };
  const Case cases[] = {{"arm7", 160, 0.002},          {"arm7", 30, 0.03},
                        {"arm7_servo", 60, 0.002},     {"coin_spin", 120, 0.002},
                        {"cube_drop", 250, 0.002},     {"cube_toss", 150, 0.0},
                        {"double_pendulum", 60, 0.03}, {"pendulum", 100, 0.002},
                        {"humanoid_drop", 400, 0.002}, {"humanoid_drop", 15, 0.03},
                        {"quadruped_drop", 150, 0.002}};
  for (const Case& c : cases) {
    Scene scene = load_scene(std::filesystem::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" /
                             (std::string(c.name) + ".yaml"));
    soften(scene);
    if (c.time_step > 0.0) scene.options.time_step = c.time_step;
    // Four feet alike slide equally fast: the fastest of them would be none.
    if (std::string(c.name) == "quadruped_drop") scene.v[3] = 0.1;
    Simulator sim(scene);
    for (int i = 0; i < c.steps; ++i) ASSERT_TRUE(sim.step().succeeded()) << c.name;
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded()) << c.name;
    expect_exact(scene, {before.q, before.v, sim.state().v, sim.input()},
                 std::string(c.name) + " " + std::to_string(c.time_step), false, 1e-6);
  }
}

/// What has no closed form is said to be by differences; du/dv+ has one always.
TEST(InverseDerivatives, OfClosuresAreByDifferences) {
  Scene scene =
      load_scene(std::filesystem::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes/closures.yaml");
  soften(scene);
  Simulator sim(scene);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const Model& model = scene.model;
  Workspace ws(model);
  Inverse out;
  InverseDerivatives exact, reference;
  step_inverse_derivatives(model, scene.options, before.q, before.v, sim.state().v, Input(), ws,
                           out, exact);
  step_inverse_derivatives(model, scene.options, before.q, before.v, sim.state().v, Input(), ws,
                           out, reference, DerivativeMethod::kExtrapolated);
  EXPECT_TRUE(exact.by_differences);
  EXPECT_LE(largest(exact.dv_next - reference.dv_next), kTolerance * largest(reference.dv_next));
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

/// All masses, and with them the contacts' laws, times s: so are forces and their derivatives.
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
  // Rounding; of weights found by sums over a body's corners.
  EXPECT_LE(largest(d[1].dq - kScale * d[0].dq), 1e-11 * largest(d[1].dq));
  EXPECT_LE(largest(d[1].dv - kScale * d[0].dv), 1e-11 * largest(d[1].dv));
  EXPECT_LE(largest(d[1].dv_next - kScale * d[0].dv_next), 1e-11 * largest(d[1].dv_next));
}

/// u(q, v, v+) and v+(q, v, u) are inverses of one another, and so are their derivatives.
TEST(ForwardDerivatives, TimesThoseOfTheInverseAreTheIdentity) {
  Scene scene =
      load_scene(std::filesystem::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes/humanoid_drop.yaml");
  // Of hard contacts, 1e6 times stiffer than the bodies are heavy, rounding leaves 5e-9.
  soften(scene);
  Simulator sim(scene);
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const Model& model = scene.model;
  Workspace ws(model);
  Inverse out;
  InverseDerivatives inverse;
  ForwardDerivatives forward;
  ASSERT_TRUE(step_forward_derivatives(model, scene.options, before.q, before.v, sim.state().v,
                                       Input(), ws, out, inverse, forward));
  ASSERT_FALSE(out.contacts.empty());
  const int nv = model.nv();
  const MatrixX identity = MatrixX::Identity(nv, nv);
  EXPECT_LE(largest(inverse.dv_next * forward.dv_du - identity), 1e-9);
  EXPECT_LE(largest(inverse.dv_next * forward.dv_dq + inverse.dq), 1e-9 * largest(inverse.dq));
  EXPECT_LE(largest(inverse.dv_next * forward.dv_dv + inverse.dv), 1e-9 * largest(inverse.dv));
  const std::size_t allocations = test::allocation_count();
  ASSERT_TRUE(step_forward_derivatives(model, scene.options, before.q, before.v, sim.state().v,
                                       Input(), ws, out, inverse, forward));
  EXPECT_EQ(test::allocation_count(), allocations);
}

/// Differences of the forward step itself: error about the square of the step, and the solver's
/// tolerance over it.
constexpr double kForwardStep = 1e-5, kForwardDifference = 1e-6;

class ForwardStep {
 public:
  ForwardStep(const Scene& scene, const Input& input)
      : scene_(scene), input_(input), ws_(scene.model), start_{0.0, scene.q, scene.v} {
    sharpen(ws_);
    next_ = step(start_, input_);
  }

  void compare() {
    const Model& model = scene_.model;
    const int nv = model.nv();
    Inverse inverse;
    InverseDerivatives d_inverse;
    ForwardDerivatives d;
    ASSERT_TRUE(step_forward_derivatives(model, scene_.options, start_.q, start_.v, next_.v, input_,
                                         ws_, inverse, d_inverse, d));
    for (int k = 0; k < nv; ++k) {
      State plus = start_, minus = start_;
      const VectorX unit = VectorX::Unit(nv, k);
      integrate_configuration(model, start_.q, unit, kForwardStep, plus.q);
      integrate_configuration(model, start_.q, unit, -kForwardStep, minus.q);
      compare_column(k, step(plus, input_), step(minus, input_), d.dv_dq, d.dq_dq);
      plus = minus = start_;
      plus.v[k] += kForwardStep;
      minus.v[k] -= kForwardStep;
      compare_column(k, step(plus, input_), step(minus, input_), d.dv_dv, d.dq_dv);
      Input more = input_, less = input_;
      more.applied_force[k] += kForwardStep;
      less.applied_force[k] -= kForwardStep;
      compare_column(k, step(start_, more), step(start_, less), d.dv_du, d.dq_du);
    }
  }

 private:
  State step(const State& from, const Input& input) {
    State next = from;
    EXPECT_TRUE(
        step_forward(scene_.model, scene_.options, settings_, from, input, ws_, next).succeeded());
    return next;
  }
  void compare_column(int k, const State& plus, const State& minus, const MatrixX& dv,
                      const MatrixX& dq) {
    const VectorX dv_k = (plus.v - minus.v) / (2.0 * kForwardStep);
    VectorX to_plus(dv_k.size()), to_minus(dv_k.size());
    configuration_difference(scene_.model, next_.q, plus.q, to_plus);
    configuration_difference(scene_.model, next_.q, minus.q, to_minus);
    const VectorX dq_k = (to_plus - to_minus) / (2.0 * kForwardStep);
    EXPECT_LE(largest(dv.col(k) - dv_k), kForwardDifference * (1.0 + largest(dv))) << k;
    EXPECT_LE(largest(dq.col(k) - dq_k), kForwardDifference * (1.0 + largest(dq))) << k;
  }

  const Scene& scene_;
  Input input_;
  Workspace ws_;
  contact::Settings settings_;
  State start_, next_;
};

TEST(ForwardDerivatives, AreThoseOfTheForwardStep) {
  for (int seed = 0; seed < 8; ++seed) {
    test::RandomModelOptions o;
    o.links = 1 + seed;
    o.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
    o.damping = o.armature = o.springs = true;
    test::Random random(40 + seed);
    const Scene scene = test::make_random_scene(seed, o, random);
    Input input;
    input.applied_force = test::random_vector(scene.model.nv(), 7 + seed);
    ForwardStep(scene, input).compare();
  }
}

TEST(ForwardDerivatives, WithContactAreThoseOfTheForwardStep) {
  test::Random random(11);
  Scene scene = two_shapes(kPlane, kCapsule, surface(0.5, 0.0, 0.0, 0.0), random, true);
  // Recovery that displaces bodies beyond their velocity is left out of the derivatives.
  scene.options.contact.max_recovery_speed = 0.0;
  Input input;
  input.applied_force = VectorX::Zero(scene.model.nv());
  ForwardStep(scene, input).compare();
}

}  // namespace
}  // namespace counterpoint
