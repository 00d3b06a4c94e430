// Forward step, then inverse: the inverse recovers the applied forces, whatever constraints acted.
#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::inverse_test {
namespace {

/// Relative to the largest force of the run: the contact solver's relative residual, 1e-12, and the
/// rounding of velocities over the compliance, 1e-16 |v| / (eps g h) of a weight
/// (contact/README.md): 5e-9 at 1 m/s, eps 1e-6 and 2 ms. The force scale, that of impacts, is
/// larger than the weight.
constexpr double kRecovered = 1e-8;
/// Without constraints only round-off is left, that of v / h relative to a.
constexpr double kRoundoff = 1e-10;

struct Recovery {
  double error = 0.0;  ///< largest difference over all steps and coordinates
  double scale = 0.0;  ///< largest force
  int contacts = 0, rows = 0;
  double relative() const { return error / scale; }
};

/// Applies random forces, redrawn every ten steps, for `steps` steps.
Recovery drive(Simulator& sim, int steps, const VectorX& force_scale, test::Random& random) {
  Recovery result;
  for (int i = 0; i < steps; ++i) {
    if (i % 10 == 0)
      sim.input().applied_force =
          force_scale.cwiseProduct(test::random_vector(sim.model().nv(), random.bits()));
    const State before = sim.state();
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << "step " << i << ": " << contact::status_name(report.status)
                                    << ", residual " << report.residual;
    if (!report.succeeded()) break;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    result.error = std::max(
        result.error, (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff());
    result.scale = std::max(result.scale, inverse.force_scale);
    result.contacts += report.contacts;
    result.rows += report.constraint_rows;
  }
  return result;
}

// The inverse sums y = J w+ + b as the solver does. The remaining error is the solver's, the
// rounding of velocities over the compliance (docs/explanation/concepts.md, Accuracy of the
// inverse).
TEST(Inverse, FindsTheImpulsesOfTheForwardStepToTheBit) {
  constexpr double kStep = 0.005;          // [s]
  constexpr double kRecoveredHere = 1e-9;  // relative to the largest force
  Scene scene = load_scene(test::source_dir() + "/data/scenes/humanoid_drop.yaml");
  const Model& model = scene.model;
  scene.options.time_step = kStep;
  Workspace forward(model), backward(model);
  State state{0.0, scene.q, scene.v, {}}, next;
  Input input;
  Inverse inverse;
  test::Random random(5);
  double error = 0.0, scale = 0.0;
  int compared = 0;
  double weight = 0.0;
  for (int b = 1; b < model.num_bodies(); ++b)
    weight += kStandardGravity * model.body(b).inertia.mass;
  constexpr double kOpenShare = 1e-10;  // the bound kOpenWeight of contact_finder.cc
  for (int i = 0; i < 400; ++i) {
    if (i % 10 == 0) {
      input.applied_force = VectorX::Zero(model.nv());
      input.applied_force.tail(model.nv() - 6) =
          test::random_vector(model.nv() - 6, random.bits(), 20.0);
    }
    const StepReport report = step_forward(model, scene.options, {}, state, input, forward, next);
    ASSERT_TRUE(report.succeeded()) << i;
    Input known;
    known.softening = report.softening;
    step_inverse(model, scene.options, state.q, state.v, next.q, next.v, known, backward, inverse);
    error = std::max(error, (inverse.applied_force - input.applied_force).cwiseAbs().maxCoeff());
    scale = std::max(scale, inverse.force_scale);
    const Workspace::Impl& ws = forward.impl();
    const auto& contacts = ws.constraints.contacts;
    size_t found = 0;
    for (const ContactForce& own : inverse.contacts) {
      if (report.softening.any()) break;
      const auto same = std::find_if(contacts.begin(), contacts.end(), [&](const auto& other) {
        return other.geometry_a == own.contact.geometry_a &&
               other.geometry_b == own.contact.geometry_b && other.position == own.contact.position;
      });
      if (same == contacts.end()) {  // near, without rows in the step: it carries nothing
        ASSERT_LT(own.contact.normal.dot(own.force), kOpenShare * weight) << i;
        continue;
      }
      const auto c = static_cast<size_t>(same - contacts.begin());
      const PairConstraint& pair = ws.constraints.pairs[c];
      const contact::Rows f = ws.solution.impulse.segment(
          ws.solution.problem.first_row(static_cast<int>(c)), pair.law.rows);
      ASSERT_EQ(own.force, pair_impulse(pair, f).force / kStep) << i << ", " << c;
      ++found;
    }
    if (!report.softening.any()) {
      ASSERT_EQ(found, contacts.size()) << i;
    }
    compared += static_cast<int>(found);
    std::swap(state, next);
  }
  EXPECT_GT(compared, 1000);
  EXPECT_LT(error, kRecoveredHere * scale);
}

class TimeStep : public ::testing::TestWithParam<double> {};

// Where capsules roll at a steady speed a step starts within a few round-off estimates of its
// solution. Newton must not stop there (contact/solve/newton.cc): stopping left an error of 2.5e-9.
TEST(Inverse, OfSteadyRollingIsAtTheRoundoffFloor) {
  Simulator sim(load_scene(test::source_dir() + "/data/scenes/accuracy/capsules_27.yaml"));
  test::Random random(1);
  const Recovery recovery = drive(sim, 5000, VectorX::Zero(sim.model().nv()), random);
  EXPECT_LT(recovery.relative(), 1e-9);
}

TEST_P(TimeStep, RandomTreesWithoutContact) {
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.damping = options.armature = seed % 2 == 0;
    options.compensations = seed % 3 == 0;
    Scene scene = test::make_random_scene(seed, options, random);
    scene.options.time_step = GetParam();
    Simulator sim(std::move(scene));
    const Model& model = sim.model();
    // 0.1 s: explicit Coriolis forces at 10 ms may accelerate light links without bound later on.
    const int steps = static_cast<int>(0.1 / GetParam());
    const Recovery r = drive(sim, steps, VectorX::Ones(model.nv()), random);
    // Rounding of the velocity, magnified by 1 / h, limits the scheme itself.
    EXPECT_LT(r.relative(), kRoundoff + 1e-13 / GetParam()) << "seed " << seed;
  }
}

TEST_P(TimeStep, TumblingBoxWithFrictionRestitutionAndContact) {
  for (const FrictionModel friction :
       {FrictionModel::kConvex, FrictionModel::kLagged, FrictionModel::kCoulomb}) {
    Scene scene = test::box_on_plane({.restitution = 0.3, .height = 0.01});
    scene.options.time_step = GetParam();
    scene.options.contact.friction_model = friction;
    scene.v << 1.0, 0.3, -1.0, 5.0, -3.0, 2.0;
    Simulator sim(std::move(scene));
    test::Random random(7);
    VectorX force(6);
    force << 10, 10, 10, 1, 1, 1;
    const int steps = std::min(5000, static_cast<int>(2.0 / GetParam()));
    const Recovery r = drive(sim, steps, force, random);
    EXPECT_GT(r.contacts, 0);
    EXPECT_LT(r.relative(), kRecovered) << "friction model " << static_cast<int>(friction);
  }
}

// Contacts found at predicted poses depend on (q, v) alone.
TEST_P(TimeStep, OverSeamsOfTiles) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/hard/seams.yaml");
  scene.options.time_step = GetParam();
  Simulator sim(std::move(scene));
  test::Random random(11);
  const int steps = std::min(2000, static_cast<int>(0.7 / GetParam()));
  const Recovery r = drive(sim, steps, VectorX::Constant(sim.model().nv(), 0.5), random);
  EXPECT_GT(r.contacts, 0);
  // The inverse's floor, 5e-9 at 1 m/s and 2 ms, scales with the speed, 2 m/s, over h
  // (contact/README.md).
  EXPECT_LT(r.relative(), std::max(kRecovered, 5e-9 * 2.0 * 0.002 / GetParam()));
}

TEST_P(TimeStep, PendulumOnItsLimit) {
  Scene scene = test::pendulum({.damping = 0.1, .lower = -0.5, .upper = 0.5});
  scene.options.time_step = GetParam();
  scene.q[0] = 0.45;
  Simulator sim(std::move(scene));
  test::Random random(3);
  const int steps = static_cast<int>(2.0 / GetParam());
  const Recovery r = drive(sim, steps, VectorX::Constant(1, 40.0), random);
  EXPECT_GT(r.rows, 0);
  EXPECT_LT(r.relative(), kRecovered);
}

TEST_P(TimeStep, RandomTreesWithSpringsServosAndDrag) {
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.springs = options.servos = options.drag = true;
    options.base = seed % 2 == 0 ? Base::kFloating : Base::kSpherical;
    options.limits = seed % 3 == 0;  // with rows, another algorithm computes M
    Scene scene = test::make_random_scene(seed, options, random);
    scene.options.time_step = GetParam();
    Simulator sim(std::move(scene));
    const Model& model = sim.model();
    sim.input().wrenches.push_back(
        {1, {random.vector(3.0), random.vector(5.0)}, random.vector(0.3)});
    const auto servos = static_cast<int>(model.servos().size());
    sim.input().servo_position = test::random_vector(servos, random.bits());
    sim.input().servo_velocity = test::random_vector(servos, random.bits());
    const int steps = static_cast<int>(0.1 / GetParam());
    const Recovery r = drive(sim, steps, VectorX::Ones(model.nv()), random);
    EXPECT_GT(servos, 0);
    // The bound without them; joint limits add that of their rows (1e-16 |v| / (eps g h),
    // contact/README.md).
    const double row = r.rows > 0 ? 1e-11 / GetParam() : 0.0;
    EXPECT_LT(r.relative(), kRoundoff + 1e-13 / GetParam() + row) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Steps, TimeStep, ::testing::Values(1e-4, 1e-3, 1e-2));

TEST(Motors, AtTheirLimitTheForceRecoveredIsTheOneThatActs) {
  int limited = 0, free = 0;
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.servos = options.effort_limits = true;
    Scene scene = test::make_random_scene(seed, options, random);
    Simulator sim(std::move(scene));
    const Model& model = sim.model();
    for (int i = 0; i < 20; ++i) {
      const VectorX applied = test::random_vector(model.nv(), random.bits(), 20.0);
      sim.input().applied_force = applied;
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded()) << seed << " step " << i;
      const State after = sim.state();
      const Inverse inverse = sim.inverse(before.q, before.v, after.v);
      const double tolerance = 1e-9 * inverse.force_scale;
      for (int j = 0; j < model.num_joints(); ++j) {
        const Body& body = model.body(j + 1);
        const double limit = model.joint(j).effort_limit;
        const int servo = model.find_servo(j);
        for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
          const double u = inverse.applied_force[k];
          const double total = u + (servo >= 0 ? inverse.servo_force[servo] : 0.0);
          const double bound = model.joint(j).actuated ? limit : 1e9;
          ASSERT_LE(std::abs(total), bound + tolerance) << seed << " joint " << j;
          if (std::abs(total) < bound - tolerance) {
            ASSERT_NEAR(u, applied[k], tolerance) << seed << " joint " << j;
            ++free;
          } else {
            ++limited;
          }
        }
      }
      // The recovered force gives the same motion.
      sim.input().applied_force = inverse.applied_force;
      sim.set_state(before);
      ASSERT_TRUE(sim.step().succeeded());
      ASSERT_LT((sim.state().v - after.v).norm(), 1e-9 * (1.0 + after.v.norm())) << seed;
    }
  }
  EXPECT_GT(limited, 100);
  EXPECT_GT(free, 100);
}

TEST(RandomTrees, HaveEveryJointTypeInTheirMiddle) {
  // The tests above must cover planar, spherical and floating joints inside trees.
  int count[5] = {};
  for (int seed = 0; seed < 20; ++seed) {
    const Model model = test::make_random_model(seed);
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      if (body.parent != 0 && body.subtree_end > i + 1) ++count[static_cast<int>(body.joint_type)];
    }
  }
  for (const int n : count) EXPECT_GT(n, 3);
}

}  // namespace
}  // namespace counterpoint::inverse_test
