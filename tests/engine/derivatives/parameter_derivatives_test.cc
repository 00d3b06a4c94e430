// Derivatives of steps with respect to parameters of the model and of the contact laws: against
// differences of whole steps of changed models, and by properties that hold in every scene.
#include <gtest/gtest.h>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/parameters/perturbed.h"
#include "support/paths.h"
#include "support/small_scenes.h"
#include "support/step_derivatives.h"

namespace counterpoint::parameter_derivatives_test {
namespace {

using K = StepParameterKind;
using test::largest;
using test::Moment;
using test::moment_of;
using test::soften;

/// Relative to the forces of a step: some hundred consecutive operations.
constexpr double kRounding = 1e-14;
// For heights: gaps are differences of positions of about a metre, rounded to 1e-16 m, over h^2 r.
constexpr double kGapRounding = 1e-13;

std::vector<int> range(int begin, int end) {
  std::vector<int> out;
  for (int i = begin; i < end; ++i) out.push_back(i);
  return out;
}

/// Returns every kind of parameter, for all elements together and for single ones.
std::vector<StepParameter> all_kinds(const Model& model) {
  std::vector<StepParameter> all = inertial_step_parameters(model);
  all.push_back(mass_parameter(model, 1));
  all.push_back(inertia_scale_parameter(model, model.num_bodies() - 1));
  const int geometries = static_cast<int>(model.geometries().size());
  // At zero a pair's friction, a geometric mean, has no slope, and restitution sets in with a jump.
  const Material m = geometries > 0 ? model.geometries()[0].material : Material();
  const std::pair<K, double> materials[] = {{K::kFriction, m.friction},
                                            {K::kRestitution, m.restitution},
                                            {K::kTorsionalFriction, m.torsional_friction},
                                            {K::kRollingFriction, m.rolling_friction}};
  for (const auto& [kind, value] : materials) {
    if (geometries == 0 || !(value > 0.0)) continue;
    all.push_back({kind, range(0, geometries), {}});
    // Friction of a pair is the geometric mean; the other coefficients are the larger of two, a
    // kink where both are equal.
    if (kind == K::kFriction) all.push_back({kind, {0}, {}});
  }
  for (int g = 0; g < geometries; ++g) all.push_back({K::kHeight, {g}, {}});
  // A floating base with joint damping or friction is not free (free_groups.h).
  std::vector<int> joints;
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.body(i).joint_type != JointType::kFloating)
      for (int k = 0; k < joint_nv(model.body(i).joint_type); ++k)
        joints.push_back(model.body(i).v_index + k);
  for (const K kind :
       {K::kDamping, K::kDryFriction, K::kBreakawayFriction, K::kStribeckSpeed, K::kArmature}) {
    // Without excess the friction of rest has a kink.
    const bool curve = kind == K::kBreakawayFriction || kind == K::kStribeckSpeed;
    if (curve && !(model.breakaway_friction().maxCoeff() > 0.0)) continue;
    // The first dry friction of a linkage removes its velocity prediction.
    if (kind == K::kDryFriction && model.num_joints() > model.num_trees() &&
        !(model.dry_friction().maxCoeff() > 0.0))
      continue;
    if (joints.empty()) continue;
    all.push_back({kind, joints, {}});
    all.push_back({kind, {joints.back()}, {}});
  }
  for (const K kind :
       {K::kGravity, K::kCompliance, K::kSmoothing, K::kStabilization, K::kMaxRecoverySpeed})
    all.push_back({kind, {}, {}});
  return all;
}

/// Returns the number of columns with closed forms.
int expect_exact_parameters(const Scene& scene, const Moment& at, const std::string& what) {
  const Model& model = scene.model;
  const std::vector<StepParameter> parameters = all_kinds(model);
  ParameterDerivator derivator(model, parameters);
  Workspace ws(model);
  Inverse out;
  InverseParameterDerivatives exact, reference;
  derivator.inverse(model, scene.options, at.q, at.v, at.v_next, Input(), ws, out, reference,
                    DerivativeMethod::kExtrapolated);
  derivator.inverse(model, scene.options, at.q, at.v, at.v_next, Input(), ws, out, exact);
  const std::size_t before = test::allocation_count();
  derivator.inverse(model, scene.options, at.q, at.v, at.v_next, Input(), ws, out, exact);
  EXPECT_EQ(test::allocation_count(), before) << what;
  int closed = 0;
  for (size_t k = 0; k < parameters.size(); ++k) {
    if (exact.by_differences[k]) continue;
    ++closed;
    const VectorX a = exact.du.col(static_cast<Eigen::Index>(k)),
                  b = reference.du.col(static_cast<Eigen::Index>(k));
    // A column may vanish; its reference is then the rounding of u over the difference step.
    const DifferenceScheme scheme = difference_scheme(parameters[k], model, scene.options);
    const double unit = parameters[k].kind == K::kHeight ? kGapRounding : kRounding;
    const double rounding = unit * out.force_scale * std::abs(scheme.weight[1]);
    EXPECT_LE(largest(a - b), test::kDerivativeTolerance * largest(b) + rounding)
        << what << ", parameter " << k << " of kind " << static_cast<int>(parameters[k].kind);
  }
  return closed;
}

TEST(ParameterDerivatives, OfRandomTreesWithEveryJointForce) {
  int closed = 0;
  for (int seed = 0; seed < 16; ++seed) {
    test::RandomModelOptions o;
    o.links = 2 + seed % 6;
    o.robots = 1 + seed % 2;
    o.base = seed % 3 == 0 ? Base::kFixed : Base::kFloating;
    o.damping = o.armature = seed % 2 == 0;
    o.limits = seed % 5 == 1;
    o.dry_friction = seed % 3 == 2;
    o.springs = seed % 4 < 2;
    o.servos = o.effort_limits = seed % 6 == 3;
    o.drag = seed % 4 == 1;
    o.compensations = seed % 4 == 2;
    test::Random random(600 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    soften(scene);
    // Slow trees, and trees fast enough for energy projection (energy_projection.h).
    scene.v *= seed % 8 < 6 ? 0.3 : 3.0;
    scene.options.time_step = seed % 3 == 1 ? 0.01 : 0.002;
    const VectorX change = test::random_vector(scene.model.nv(), random.bits(), 0.1);
    const Moment at{scene.q, scene.v, scene.v + change, {}};
    closed += expect_exact_parameters(scene, at, "seed " + std::to_string(seed));
    if (!o.dry_friction) continue;
    ModelEditor editor(scene.model);
    for (int k = 0; k < scene.model.nv(); ++k) {
      if (!(scene.model.dry_friction()[k] > 0.0)) continue;
      editor.set_breakaway_friction(k, scene.model.dry_friction()[k] + random.uniform(0.1, 1.0));
      editor.set_stribeck_speed(k, random.uniform(0.2, 1.0));
    }
    scene.model = editor.take();
    closed += expect_exact_parameters(scene, at, "curve, seed " + std::to_string(seed));
  }
  EXPECT_GT(closed, 500);
}

Scene bundled(const std::string& name) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/" + name);
  soften(scene);
  return scene;
}

TEST(ParameterDerivatives, OfBallsByEveryLaw) {
  int closed = 0;
  for (const FrictionModel friction :
       {FrictionModel::kCoulomb, FrictionModel::kConvex, FrictionModel::kLagged}) {
    for (int kind = 0; kind < 6; ++kind) {
      test::BallOnPlane ball;
      ball.material.friction = kind == 0 ? 0.0 : 0.5;
      ball.material.restitution = kind % 3 == 2 ? 0.4 : 0.0;
      ball.material.torsional_friction = kind >= 3 ? 0.02 : 0.0;
      ball.material.rolling_friction = kind >= 4 ? 0.01 : 0.0;
      ball.height = kind % 2 == 0 ? -1e-3 : 2e-4;
      Scene scene = test::ball_on_plane(ball);
      soften(scene);
      scene.options.contact.friction_model = friction;
      test::Random random(40 + kind);
      scene.v = test::random_vector(6, random.bits(), 1.0);
      scene.v[2] = -0.3;
      const VectorX next = scene.v + test::random_vector(6, random.bits(), 0.3);
      closed += expect_exact_parameters(
          scene, {scene.q, scene.v, next, {}},
          "law " + std::to_string(static_cast<int>(friction)) + ", ball " + std::to_string(kind));
    }
  }
  EXPECT_GT(closed, 380);
}

TEST(ParameterDerivatives, OfRobotsThatStand) {
  for (const char* name : {"quadruped_drop.yaml", "humanoid_drop.yaml"}) {
    Scene scene = bundled(name);
    EXPECT_GT(expect_exact_parameters(scene, moment_of(scene, 150), name), 20);
  }
}

TEST(ParameterDerivatives, ForcesScaleWithAllMasses) {
  // Regularizers and smoothing scale too: u is linear in all inertial parameters together.
  constexpr double kRelative = 1e-9;  // differences of inverse weights
  Scene scene = bundled("box_stack.yaml");
  const Model& model = scene.model;
  const Moment at = moment_of(scene, 60);
  StepParameter all;
  for (int body = 1; body < model.num_bodies(); ++body) {
    all.targets.push_back(body);
    all.changes.push_back(inertial_parameters(model.body(body).inertia));
  }
  ParameterDerivator derivator(model, {all});
  Workspace ws(model);
  Inverse out;
  InverseParameterDerivatives d;
  VectorX next = at.v_next;
  next.array() += 0.01;  // otherwise u is zero
  derivator.inverse(model, scene.options, at.q, at.v, next, Input(), ws, out, d);
  EXPECT_FALSE(d.by_differences[0]);
  EXPECT_GT(largest(out.contact_force), 1.0);
  EXPECT_LE(largest(d.du.col(0) - out.applied_force), kRelative * out.force_scale);
}

TEST(ParameterDerivatives, ForwardOnesAreThoseOfTheStep) {
  // Differences of the solver's result, which is accurate to its tolerance.
  constexpr double kRelative = 1e-6, kFloor = 1e-6;  // a ball's motion does not depend on its mass
  test::BallOnPlane ball;
  ball.material.friction = 0.5;
  ball.height = 2e-4;  // closes within the step
  Scene scene = test::ball_on_plane(ball);
  soften(scene);
  scene.v << 0.5, -0.3, -0.4, 1.0, 2.0, -0.5;
  const std::vector<StepParameter> parameters = {
      mass_parameter(scene.model, 1), {K::kFriction, {0, 1}, {}},
      {K::kHeight, {0}, {}},          inertia_scale_parameter(scene.model, 1),
      {K::kGravity, {}, {}},          {K::kCompliance, {}, {}},
      {K::kSmoothing, {}, {}}};
  contact::Settings settings;
  settings.tolerance = 1e-14;
  const State start{0.0, scene.q, scene.v};
  const auto step = [&](const Model& model, const SimulationOptions& options) {
    Workspace ws(model);
    State next = start;
    EXPECT_TRUE(step_forward(model, options, settings, start, Input(), ws, next).succeeded());
    return next;
  };
  const State next = step(scene.model, scene.options);
  Workspace ws(scene.model);
  Inverse inverse;
  InverseDerivatives by_motion;
  ForwardDerivatives forward;
  ASSERT_TRUE(step_forward_derivatives(scene.model, scene.options, start.q, start.v, next.v,
                                       Input(), ws, inverse, by_motion, forward));
  ParameterDerivator derivator(scene.model, parameters);
  InverseParameterDerivatives d;
  derivator.inverse(scene.model, scene.options, start.q, start.v, next.v, Input(), ws, inverse, d);
  MatrixX dv, dq;
  forward_parameter_derivatives(forward, d.du, dv, dq);
  for (size_t k = 0; k < parameters.size(); ++k) {
    const DifferenceScheme scheme = difference_scheme(parameters[k], scene.model, scene.options);
    std::array<VectorX, 4> v, p;
    for (size_t i = 0; i < v.size(); ++i) {
      Model model = scene.model;
      SimulationOptions options = scene.options;
      change_parameter(parameters[k], scheme.at[i], model, options);
      const State there = step(model, options);
      v[i] = there.v;
      p[i] = there.q.head<3>();
    }
    const auto column = static_cast<Eigen::Index>(k);
    const VectorX by = scheme(v);
    EXPECT_LE(largest(dv.col(column) - by), kRelative * (kFloor + largest(by))) << k;
    EXPECT_LE(largest(dq.col(column).head<3>() - scheme(p)), kRelative * (kFloor + largest(by)))
        << k;
  }
}

TEST(ParameterDerivatives, WantsTargetsThatAreThere) {
  const Scene scene = test::ball_on_plane({});
  EXPECT_THROW(ParameterDerivator(scene.model, {{K::kFriction, {7}, {}}}), InputError);
  EXPECT_THROW(ParameterDerivator(scene.model, {{K::kInertia, {1}, {}}}), InputError);
  EXPECT_THROW(ParameterDerivator(scene.model, {{K::kInertia, {0}, {InertialParameters::Zero()}}}),
               InputError);
}

}  // namespace
}  // namespace counterpoint::parameter_derivatives_test
