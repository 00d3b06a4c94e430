// Derivatives of the forward step: against its differences, and as the inverse of those of the
// inverse step.
#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "support/paths.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"
#include "support/two_shapes.h"

namespace counterpoint::forward_derivatives_test {
namespace {

using test::largest;
using test::sharpen;
using test::soften;
using test::surface;
using test::two_shapes;
using enum ShapeType;

/// u(q, v, v+) and v+(q, v, u) are inverse functions, and their derivatives inverse matrices.
void expect_inverses(const Scene& scene, const test::Moment& at, const std::string& what) {
  const Model& model = scene.model;
  Workspace ws(model);
  Inverse out;
  InverseDerivatives inverse;
  ForwardDerivatives forward;
  ASSERT_TRUE(step_forward_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next,
                                       at.known, ws, out, inverse, forward))
      << what;
  EXPECT_FALSE(inverse.by_differences) << what;
  const int nv = model.nv();
  const MatrixX identity = MatrixX::Identity(nv, nv);
  EXPECT_LE(largest(inverse.dv_next * forward.dv_du - identity), 1e-9) << what;
  EXPECT_LE(largest(inverse.dv_next * forward.dv_dq + inverse.dq), 1e-9 * largest(inverse.dq))
      << what;
  EXPECT_LE(largest(inverse.dv_next * forward.dv_dv + inverse.dv), 1e-9 * largest(inverse.dv))
      << what;
  const std::size_t allocations = test::allocation_count();
  ASSERT_TRUE(step_forward_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next,
                                       at.known, ws, out, inverse, forward));
  EXPECT_EQ(test::allocation_count(), allocations) << what;
}

TEST(ForwardDerivatives, TimesThoseOfTheInverseAreTheIdentity) {
  const std::pair<const char*, int> cases[] = {{"humanoid_drop", 400},
                                               {"closures", 600},
                                               {"everything", 150},
                                               {"terrain", 400},
                                               {"hard/geared", 60}};
  for (const auto& [name, steps] : cases) {
    Scene scene = load_scene(std::filesystem::path(test::source_dir()) / "data/scenes" /
                             (std::string(name) + ".yaml"));
    // Hard contacts are 1e6 times stiffer than the bodies' inertia: rounding would leave 5e-9.
    soften(scene);
    expect_inverses(scene, test::moment_of(scene, steps), name);
  }
}

/// Extrapolated differences of the forward step: the error is of order four in the difference step,
/// plus the solver's tolerance over it.
constexpr double kForwardStep = 1e-5, kForwardDifference = 1e-6;
/// With default contacts the solver leaves the rounding of velocities over the compliance, 1.1e-16
/// / 1e-6, over the difference step.
constexpr double kHardDifference = 2e-5;

class ForwardStep {
 public:
  ForwardStep(const Scene& scene, const Input& input)
      : scene_(scene), input_(input), ws_(scene.model), start_{0.0, scene.q, scene.v} {
    sharpen(ws_);
    next_ = step(start_, input_);
  }

  void compare(double tolerance = kForwardDifference) {
    tolerance_ = tolerance;
    const Model& model = scene_.model;
    const int nv = model.nv();
    Inverse inverse;
    InverseDerivatives d_inverse;
    ForwardDerivatives d;
    ASSERT_TRUE(step_forward_derivatives(model, scene_.options, start_.q, start_.v, next_.q,
                                         next_.v, input_, ws_, inverse, d_inverse, d));
    for (int k = 0; k < nv; ++k) {
      const VectorX unit = VectorX::Unit(nv, k);
      compare_column(k, d.dv_dq, d.dq_dq, [&](double s) {
        State from = start_;
        integrate_configuration(model, start_.q, unit, s, from.q);
        return step(from, input_);
      });
      compare_column(k, d.dv_dv, d.dq_dv, [&](double s) {
        State from = start_;
        from.v[k] += s;
        return step(from, input_);
      });
      compare_column(k, d.dv_du, d.dq_du, [&](double s) {
        Input input = input_;
        input.applied_force[k] += s;
        return step(start_, input);
      });
    }
  }

  /// Returns the largest difference between the change of pose over h and the final velocity [m/s,
  /// rad/s].
  double displacement() const {
    VectorX to(scene_.model.nv());
    configuration_difference(scene_.model, start_.q, next_.q, to);
    return largest(to / scene_.options.time_step - next_.v);
  }

 private:
  State step(const State& from, const Input& input) {
    State next = from;
    EXPECT_TRUE(
        step_forward(scene_.model, scene_.options, settings_, from, input, ws_, next).succeeded());
    return next;
  }
  /// Change of the result relative to the unperturbed step: velocities, then displacements.
  VectorX away(const State& next) const {
    const int nv = scene_.model.nv();
    VectorX out(2 * nv), to(nv);
    configuration_difference(scene_.model, next_.q, next.q, to);
    out << next.v, to;
    return out;
  }
  template <class MovedStep>
  void compare_column(int k, const MatrixX& dv, const MatrixX& dq, const MovedStep& moved) {
    const auto central = [&](double s) -> VectorX {
      return (away(moved(s)) - away(moved(-s))) / (2.0 * s);
    };
    const VectorX d = (4.0 * central(kForwardStep) - central(2.0 * kForwardStep)) / 3.0;
    const int nv = scene_.model.nv();
    EXPECT_LE(largest(dv.col(k) - d.head(nv)), tolerance_ * (1.0 + largest(dv))) << k;
    EXPECT_LE(largest(dq.col(k) - d.tail(nv)), tolerance_ * (1.0 + largest(dq))) << k;
  }

  const Scene& scene_;
  Input input_;
  Workspace ws_;
  contact::Settings settings_;
  State start_, next_;
  double tolerance_ = kForwardDifference;
};

class Integrated : public ::testing::TestWithParam<Integrator> {};

TEST_P(Integrated, AreThoseOfTheForwardStep) {
  for (int seed = 0; seed < 8; ++seed) {
    test::RandomModelOptions o;
    o.links = 1 + seed;
    o.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
    o.damping = o.armature = o.springs = true;
    o.servos = seed % 4 == 1;
    o.drag = seed % 3 == 2;
    o.compensations = seed % 4 == 2;
    test::Random random(40 + seed);
    Scene scene = test::make_random_scene(seed, o, random);
    scene.options.integrator = GetParam();
    Input input;
    input.applied_force = test::random_vector(scene.model.nv(), 7 + seed);
    input.wrenches.push_back({scene.model.num_bodies() - 1,
                              {random.vector(2.0), random.vector(5.0)},
                              random.vector(0.3)});
    ForwardStep(scene, input).compare();
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, Integrated,
                         ::testing::Values(Integrator::kSemiImplicitEuler,
                                           Integrator::kImplicitMidpoint,
                                           Integrator::kRungeKutta4));

class InvertedIntegrator : public ::testing::TestWithParam<Integrator> {};

TEST_P(InvertedIntegrator, WithContactAreThoseOfTheForwardStep) {
  test::Random random(11);
  Scene scene = two_shapes(kPlane, kCapsule, surface(0.5, 0.0, 0.0, 0.0), random, true);
  scene.options.integrator = GetParam();
  Input input;
  input.applied_force = VectorX::Zero(scene.model.nv());
  ForwardStep step(scene, input);
  // Overlap of 2 mm: displacement recovers a part of it. The midpoint rule displaces nothing.
  const bool displaces = GetParam() == Integrator::kSemiImplicitEuler;
  EXPECT_EQ(step.displacement() > 0.1, displaces);
  step.compare();
}

/// A shape about to bounce off another within the step, with softened or default laws.
Scene bouncing(ShapeType a, ShapeType b, bool hard, int seed) {
  test::Random random(70 + seed);
  Scene scene = two_shapes(a, b, surface(0.0, 0.6, 0.0, 0.0), random, false);
  if (hard) scene.options.contact = ContactOptions();
  scene.options.time_step = 2e-3;
  Workspace ws(scene.model);
  Inverse out;
  // Moves at 2 m/s towards the nearest point: 0.3 mm in 0.15 ms.
  step_inverse(scene.model, scene.options, scene.q, scene.v, scene.v, ws, out);
  scene.v.setZero();
  const collision::Candidate& contact = out.contacts.front().contact;
  const int first = scene.model.geometries()[static_cast<size_t>(contact.geometry_a)].body;
  scene.v.head<3>() = (first == 1 ? 2.0 : -2.0) * contact.normal;
  return scene;
}

/// An impact within the step, whose time the poses account for (bounce.h). Without friction and
/// spin, whose impulses have no closed form (derivatives.md).
TEST(ForwardDerivatives, AcrossABounceAreThoseOfTheForwardStep) {
  const std::pair<ShapeType, ShapeType> pairs[] = {{kPlane, kSphere}, {kSphere, kSphere}};
  for (const auto& [a, b] : pairs) {
    for (const bool hard : {false, true}) {
      for (int seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << static_cast<int>(b) << " hard " << hard << " " << seed);
        Input input;
        const Scene scene = bouncing(a, b, hard, seed);
        input.applied_force = test::random_vector(scene.model.nv(), 9 + seed);
        ForwardStep step(scene, input);
        EXPECT_GT(step.displacement(), 0.1);
        step.compare(hard ? kHardDifference : kForwardDifference);
      }
    }
  }
}

/// Rods and drag act on the displaced bodies; one body bounces while another lies 1 mm deep.
TEST(ForwardDerivatives, AcrossABounceOfLinkedBodiesAreThoseOfTheForwardStep) {
  const test::TempFolder folder;
  const auto file = folder.write("tied.yaml", R"(
time_step: 0.002
ground: {friction: 0.5}
models:
  - {name: a, sphere: 0.1, mass: 1, position: [0, 0, 0.1005], friction: 0.5,
     restitution: 0.6, velocity: {linear: [0.2, -0.1, -1.5], angular: [0.1, 0.2, 0.3]}, drag: {linear: 1, quadratic: 2}}
  - {name: b, sphere: 0.1, mass: 2, position: [0.5, 0, 0.3], velocity: {linear: [0.2, 0.1, 0.2]}}
  - {name: c, sphere: 0.1, mass: 1, position: [0.5, 0.6, 0.099], friction: 0.5}
closures:
  - {type: distance, between: [a/body, b/body]}
  - {type: distance, between: [b/body, c/body]}
)");
  Scene scene = load_scene(file);
  soften(scene);
  Input input;
  input.applied_force = test::random_vector(scene.model.nv(), 5);
  ForwardStep step(scene, input);
  EXPECT_GT(step.displacement(), 0.1);
  step.compare();
}

/// Constraint rows of every kind except contacts: limits, dry friction, closures, mimic joints.
TEST_P(InvertedIntegrator, WithJointRowsAndTiesAreThoseOfTheForwardStep) {
  for (int seed = 0; seed < 9; ++seed) {
    test::RandomModelOptions o;
    o.links = 2 + seed;
    o.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
    o.fixed_share = 0.0;
    o.damping = o.armature = o.springs = true;
    o.limits = seed % 3 == 0;
    o.dry_friction = seed % 3 == 1;
    o.closures = seed % 3;
    o.mimics = seed % 2 == 1;
    test::Random random(60 + seed);
    Model model = test::make_random_model(seed, o);
    const int nv = model.nv();
    VectorX q = model.default_q();
    integrate_configuration(model, model.default_q(), test::random_vector(nv, random.bits(), 1e-3),
                            1.0, q);
    VectorX v = test::random_vector(nv, random.bits(), 0.5);
    Scene scene{"random", std::move(model), std::move(q), std::move(v), {}};
    soften(scene);
    scene.options.integrator = GetParam();
    Input input;
    input.applied_force = test::random_vector(nv, 7 + seed);
    ForwardStep(scene, input).compare();
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, InvertedIntegrator,
                         ::testing::Values(Integrator::kSemiImplicitEuler,
                                           Integrator::kImplicitMidpoint));

}  // namespace
}  // namespace counterpoint::forward_derivatives_test
