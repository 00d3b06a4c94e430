// Runs with actuators of every law: their inverse, their states, their derivatives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "engine/forces/driven/wheel.h"
#include "support/linkages.h"
#include "support/random_model.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::actuators_test {
namespace {

/// The inverse recovers applied forces beside actuators of every kind.
TEST(Actuators, InverseRecoversAppliedForces) {
  double worst = 0.0;
  int rows = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    test::RandomModelOptions options = test::varied_options(static_cast<int>(seed));
    options.links += 2;
    options.fixed_share = 0.0;
    options.tendons = seed % 2 == 0 ? 1 : 0;
    options.actuators = 4;
    options.armature = true;
    test::Random random(seed);
    Scene scene = test::make_random_scene(seed, options, random);
    rows += static_cast<int>(scene.model.actuators().size());
    Simulator sim(std::move(scene));
    const auto& actuators = sim.model().actuators();
    worst = std::max(worst, test::recover(sim, 60, 1.0, random, [&] {
                       sim.input().command =
                           test::random_vector(static_cast<int>(actuators.size()), random.bits());
                     }));
  }
  EXPECT_LT(worst, test::kRecovered);
  EXPECT_GT(rows, 50);
}

/// The midpoint rule takes them too.
TEST(Actuators, MidpointStepsAreRecovered) {
  test::RandomModelOptions options;
  options.actuators = 5;
  test::Random random(3);
  Scene scene = test::make_random_scene(3, options, random);
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  sim.settings().tolerance = 1e-12;
  for (int i = 0; i < 50; ++i) {
    sim.input().applied_force = test::random_vector(sim.model().nv(), random.bits());
    sim.input().command = test::random_vector(5, random.bits());
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.last_forces();
    const VectorX off = inverse.applied_force - sim.input().applied_force;
    // Poses are rounded, and the contact velocity is read off them.
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-7 * inverse.force_scale) << i;
    EXPECT_LT((inverse.z_next - sim.state().z).norm(), 1e-8) << i;
  }
}

/// Two runs with the same input have the same bits, and one resumed from a file goes on with them.
TEST(Actuators, RunsResumeWithTheSameBits) {
  test::RandomModelOptions options;
  options.actuators = 8;
  options.base = Base::kFixed;
  test::Random random(5);
  const Scene scene = test::make_random_scene(5, options, random);
  ASSERT_GT(scene.model.nz(), 3);
  Simulator first(scene);
  const auto drive = [](Simulator& sim, int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto count = static_cast<int>(sim.model().actuators().size());
      sim.input().command = test::random_vector(count, static_cast<std::uint64_t>(i / 7));
      ASSERT_TRUE(sim.step().succeeded());
    }
  };
  drive(first, 0, 100);
  const test::TempFolder folder;
  const auto file = folder.path() / "state.csv";
  write_state(file, first.model(), first.options(), first.state());
  Simulator second(scene);
  second.set_state(read_state(file, second.model(), second.options()));
  EXPECT_EQ(state_hash(first.state()), state_hash(second.state()));
  drive(first, 100, 200);
  drive(second, 100, 200);
  EXPECT_EQ(state_hash(first.state()), state_hash(second.state()));
}

/// Where all actuators drive joints by affine, PID and DC laws, derivatives are closed forms.
TEST(Actuators, DerivativesOnJointsAreClosedForms) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    test::RandomModelOptions options = test::varied_options(static_cast<int>(seed));
    options.links += 2;
    options.fixed_share = 0.0;
    options.actuators = 3;
    options.armature = true;
    test::Random random(seed);
    Scene scene = test::make_random_scene(seed, options, random);
    scene.options.mean_velocity_forces = false;
    const auto& all = scene.model.actuators();
    if (all.empty() || std::any_of(all.begin(), all.end(), [](const Actuator& a) {
          return a.transmission == Transmission::kLink;
        }))
      continue;
    Simulator sim(scene);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(sim.step().succeeded());
    const State before = sim.state();
    sim.input().command = test::random_vector(static_cast<int>(all.size()), random.bits());
    ASSERT_TRUE(sim.step().succeeded());
    test::Moment at{before.q, before.v, sim.state().v, sim.input()};
    at.known.z = before.z;
    ++compared;
    EXPECT_TRUE(test::expect_exact(scene, at, "seed " + std::to_string(seed)));
  }
  EXPECT_GT(compared, 5);
}

/// A command on a joint changes the step like an applied force of gear dF/du, as the page of
/// actuators says.
TEST(Actuators, CommandsActLikeAppliedForces) {
  Actuator position = test::named("motor");
  position.gain = position.stiffness = 30.0;
  position.damping = 2.0;
  Actuator coil = test::named("motor");
  coil.law = ActuatorLaw::kDcMotor;
  coil.torque_constant = 0.3;
  coil.resistance = 1.5;
  coil.inductance = 0.02;
  const double h = 0.002;
  for (auto [actuator, slope] :
       {std::pair(position, 30.0), std::pair(coil, 0.3 / (1.5 + 0.02 / h))}) {
    actuator.gear = -3.0;
    Simulator sim(test::wheel(actuator));
    const State start = sim.state();
    const auto speed_at = [&](double command) {
      sim.set_state(start);
      sim.input().command = VectorX::Constant(1, command);
      EXPECT_TRUE(sim.step().succeeded());
      return sim.state().v[0];
    };
    const double by_command = 0.5 * (speed_at(1.0) - speed_at(-1.0));
    speed_at(0.0);
    Workspace workspace(sim.model());
    Inverse inverse;
    InverseDerivatives d_inverse;
    ForwardDerivatives d;
    ASSERT_TRUE(step_forward_derivatives(sim.model(), sim.options(), start.q, start.v,
                                         sim.state().v, sim.input(), workspace, inverse, d_inverse,
                                         d));
    // Both are linear: rounding of a solution to 1e-12.
    EXPECT_NEAR(by_command, -3.0 * slope * d.dv_du(0, 0), 1e-11);
  }
}

/// Derivatives by actuators on links are differences of the whole step, and say so.
TEST(Actuators, DerivativesAreDifferencesAndSaySo) {
  test::RandomModelOptions options;
  options.actuators = 4;
  test::Random random(9);
  Simulator sim(test::make_random_scene(9, options, random));
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  Input known = sim.input();
  known.z = before.z;
  Workspace workspace(sim.model());
  Inverse inverse;
  InverseDerivatives d;
  step_inverse_derivatives(sim.model(), sim.options(), before.q, before.v, sim.state().v, known,
                           workspace, inverse, d);
  EXPECT_TRUE(d.by_differences);
  // du/dv+ is the closed form: one column against a difference.
  VectorX v = sim.state().v;
  const double step = 1e-6;
  v[0] += step;
  Inverse moved;
  step_inverse(sim.model(), sim.options(), before.q, before.v, v, known, workspace, moved);
  const VectorX column = (moved.applied_force - inverse.applied_force) / step;
  EXPECT_LT((column - d.dv_next.col(0)).norm(), 1e-5 * d.dv_next.col(0).norm());
}

TEST(Actuators, StepsDoNotAllocate) {
  test::RandomModelOptions options;
  options.actuators = 6;
  test::Random random(4);
  Simulator sim(test::make_random_scene(4, options, random));
  test::expect_no_allocations(sim, 20);
}
}  // namespace
}  // namespace counterpoint::actuators_test
