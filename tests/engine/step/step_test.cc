// Steps against answers known in advance: the discrete scheme worked out by hand wherever possible,
// so that tolerances are round-off.
#include "counterpoint/engine/step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "counterpoint/engine/simulator.h"
#include "support/allocation_guard.h"
#include "support/small_scenes.h"
#include "support/temp_folder.h"

namespace counterpoint::step_test {
namespace {

using test::BoxOnPlane;

constexpr double kRoundoff = 1e-12;
// Bodies rest or slide steadily to the solver's residual (1e-10 of the momentum of a step;
// measured: 7e-13 of the weight, 6e-11 of g).
constexpr double kSteady = 1e-9;

void run(Simulator& sim, double duration) {
  const int steps = static_cast<int>(std::lround(duration / sim.options().time_step));
  for (int i = 0; i < steps; ++i) {
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded()) << "step " << i << ": " << contact::status_name(report.status);
  }
}

TEST(FreeFlight, FollowsTheDiscreteParabolaWhileSpinning) {
  Simulator sim(test::box_on_plane({.ground = false}));
  State start = sim.state();
  start.v << 1.0, -2.0, 3.0, 4.0, 5.0, -6.0;
  sim.set_state(start);
  const double h = sim.options().time_step;
  const int n = 500;
  for (int i = 0; i < n; ++i) ASSERT_TRUE(sim.step().succeeded());
  // Semi-implicit Euler: z_n = z_0 + n h v_0 - g h^2 n (n + 1) / 2.
  const Vector3 expected =
      start.q.head<3>() + n * h * start.v.head<3>() - Vector3(0, 0, 9.81 * h * h * n * (n + 1) / 2);
  EXPECT_LT((sim.state().q.head<3>() - expected).norm(), 1e-11);  // 500 roundings of metres
}

TEST(Pendulum, OneStepIsTheSchemeByHand) {
  const double m = 1.3, l = 0.7, damping = 0.4, rotor = 0.05, h = 0.01, q0 = 0.9, w0 = -1.1,
               u = 0.6;
  Scene scene = test::pendulum({.mass = m, .length = l, .damping = damping, .armature = rotor});
  scene.options.time_step = h;
  scene.q[0] = q0;
  scene.v[0] = w0;
  Simulator sim(std::move(scene));
  sim.input().applied_force[0] = u;
  sim.step();
  const double inertia = m * l * l + rotor;
  // (I + h D)(w+ - w) = h (u - m g l sin q - D w)
  const double w1 =
      w0 + h * (u - m * 9.81 * l * std::sin(q0) - damping * w0) / (inertia + h * damping);
  EXPECT_NEAR(sim.state().v[0], w1, kRoundoff);
  EXPECT_NEAR(sim.state().q[0], q0 + h * w1, kRoundoff);
  const Inverse& inverse =
      sim.inverse(VectorX::Constant(1, q0), VectorX::Constant(1, w0), sim.state().v);
  EXPECT_NEAR(inverse.applied_force[0], u, 1e-11);  // round-off of w / h
}

TEST(JointLimit, StopsThePendulumAndCarriesItsWeight) {
  Scene scene = test::pendulum({.lower = -0.5, .upper = 2.0});
  scene.q[0] = 1.0;
  Simulator sim(std::move(scene));
  run(sim, 5.0);
  // It has fallen onto the lower limit or swings inside. It passes the limit by no more than the
  // compliance yields under 20 N m, h^2 eps 20 / (kg m^2) = 8e-11 rad a step, of which each step
  // recovers a fifth or more.
  constexpr double kYields = 1e-9;
  EXPECT_GT(sim.state().q[0], -0.5 - kYields);
  // A torque presses it against the limit; the limit force is that torque less gravity's.
  sim.input().applied_force[0] = -20.0;
  run(sim, 2.0);
  EXPECT_NEAR(sim.state().q[0], -0.5, kYields);
  const VectorX q = sim.state().q, v = sim.state().v;
  ASSERT_TRUE(sim.step().succeeded());
  const Inverse& inverse = sim.inverse(q, v, sim.state().v);
  EXPECT_NEAR(inverse.contact_force[0], 20.0 - 9.81 * std::sin(0.5), 20.0 * kSteady);
}

TEST(BoxAtRest, CarriesItsWeightAndHoversByTheSmoothingLength) {
  Simulator sim(test::box_on_plane({.mass = 3.0}));
  run(sim, 1.0);
  const VectorX q = sim.state().q, v = sim.state().v;
  ASSERT_TRUE(sim.step().succeeded());
  const Inverse& inverse = sim.inverse(q, v, sim.state().v);
  ASSERT_EQ(inverse.contacts.size(), 4u);
  Vector3 sum = Vector3::Zero();
  for (const ContactForce& c : inverse.contacts) {
    EXPECT_LT(c.contact.geometry_a, c.contact.geometry_b);
    sum += c.force;
  }
  // Force on geometry B; the box has the lower index, so the ground is pushed down.
  EXPECT_NEAR(std::abs(sum.z()), 3.0 * 9.81, 3.0 * 9.81 * kSteady);
  EXPECT_LT(sum.head<2>().norm(), 3.0 * 9.81 * kSteady);
  EXPECT_LT(v.norm(), kSteady);
  // It stands at the smoothing length (at four of them, as four corners share the weight), less the
  // yield of the regularizer: h * eps * alpha * f with f = h m g / 4.
  const ContactOptions& options = sim.options().contact;
  const double h = sim.options().time_step;
  const double give = h * options.compliance * h * 9.81;
  EXPECT_NEAR(q[2] - 0.1, 0.0, 4.0 * options.smoothing + give);
}

TEST(Slope, CreepIsWhatTheRegularizerExplains) {
  // tan(theta) = 0.4 < mu = 0.5: the box holds, creeping at eps g h sin(theta) or less per contact.
  const double tangent = 0.4, cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
  Scene scene =
      test::box_on_plane({.friction = 0.5, .gravity = 9.81 * cosine * Vector3(tangent, 0, -1)});
  const double eps = scene.options.contact.compliance, h = scene.options.time_step;
  Simulator sim(std::move(scene));
  run(sim, 1.0);
  const double creep = sim.state().v.head<3>().norm();
  EXPECT_LT(creep, 1.5 * eps * 9.81 * h * tangent * cosine);
  EXPECT_GT(creep, 0.0);
}

TEST(Slope, SteeperThanTheConeItSlidesWithCoulombsAcceleration) {
  const double tangent = 0.8, cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
  Simulator sim(test::box_on_plane({.half = Vector3(0.2, 0.2, 0.05),
                                    .friction = 0.5,
                                    .gravity = 9.81 * cosine * Vector3(tangent, 0, -1)}));
  run(sim, 0.5);
  const double v0 = sim.state().v[0];
  run(sim, 0.5);
  const double a = (sim.state().v[0] - v0) / 0.5;
  EXPECT_NEAR(a, 9.81 * cosine * (tangent - 0.5), 9.81 * kSteady);
}

TEST(Restitution, AnImpactWithinAStepIsTheExactBounce) {
  // In free fall velocities are those half a step before their poses, so that (w - g h / 2)^2 / 2 +
  // g z is the energy of the exact parabola. Each impact leaves e^2 of it, at any time within the
  // step.
  const double g = 9.81, h = 2e-3;
  for (const double e : {0.1, 0.5, 0.9}) {
    for (const double height : {0.05, 0.0517, 0.1234, 0.5, 1.003, 1.01}) {
      Simulator sim(test::box_on_plane({.friction = 0.0, .restitution = e, .height = height}));
      sim.options().time_step = h;
      const double rest = sim.state().q[2] - height;
      const auto energy = [&] {
        const double u = sim.state().v[2] - 0.5 * g * h;
        return 0.5 * u * u + g * (sim.state().q[2] - rest);
      };
      const double start = energy();
      for (int i = 0; i < 1000 && sim.state().v[2] <= 0.0; ++i) {
        const VectorX q = sim.state().q, v = sim.state().v;
        ASSERT_TRUE(sim.step().succeeded());
        const Inverse& inverse = sim.inverse(q, v, sim.state().v);
        // In flight forces cancel to rounding, but for those of near contacts without rows, 1e-10
        // of the weight each; those of an impact, about 1e3 N, are recovered to 1e-8.
        const double weight = g * sim.model().body(1).inertia.mass;
        EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(),
                  4e-10 * weight + 1e-8 * inverse.force_scale);
      }
      // The compliance of the four contacts: eps of the velocity.
      EXPECT_NEAR(energy(), e * e * start, 1e-5 * start) << e << ' ' << height;
    }
  }
}

/// A rod of 1 m on a revolute joint, without gravity, comes down at 10 rad/s at an angle q from the
/// vertical. Its tip is 12 mm above the ground, beyond the margin of contacts. If `inside` [m] is
/// above 0, a ball about the joint overlaps a box by it and turns in it freely.
Simulator striking_rod(double q, double friction, double inside = 0.0) {
  constexpr double kAbove = 0.012, kTip = 0.02, kBall = 0.1, kHalf = 0.1;  // m
  const double height = std::cos(q) + kTip + kAbove;
  const test::TempFolder folder;
  folder.write("rod.urdf", R"(<robot name="rod"><link name="base"/>
    <link name="rod">
      <inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin xyz="0 0 -1"/><geometry><sphere radius="0.02"/></geometry></collision>
      <collision><geometry><sphere radius="0.1"/></geometry></collision>
    </link>
    <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint>
  </robot>)");
  std::ostringstream text;
  const std::string surface = "friction: " + std::to_string(friction) + ", restitution: 0.5";
  text << "time_step: 0.002\ngravity: [0, 0, 0]\nground: {" << surface << "}\nmodels:\n"
       << "  - {urdf: rod.urdf, base: fixed, " << surface << ", position: [0, 0, " << height
       << "], joints: {hinge: " << q << "}, joint_velocities: {hinge: -10}}\n";
  if (inside > 0.0) {
    text << "  - {name: box, box: [0.2, 0.2, 0.2], mass: 1, base: fixed, " << surface
         << ", position: [0, " << kBall + kHalf - inside << ", " << height << "]}\n";
  }
  return Simulator(load_scene(folder.write("rod.yaml", text.str())));
}

/// Returns its speed [rad/s] 20 steps later; no step may increase it.
double speed_after_strike(Simulator sim) {
  constexpr double kCompliance = 1e-5;  // bound of the bounce above
  const double start = std::abs(sim.state().v[0]);
  double speed = start;
  for (int k = 0; k < 20; ++k) {
    EXPECT_TRUE(sim.step().succeeded());
    EXPECT_LE(std::abs(sim.state().v[0]), speed + kCompliance * start);
    speed = std::abs(sim.state().v[0]);
  }
  return speed;
}

// At 45 degrees the tip slides as fast as it falls: a law that raised the normal velocity by mu
// |v_T| above e v would make it leave at e v / (sin q - mu cos q).
TEST(Restitution, ARodThatStrikesAslantGainsNoEnergy) {
  for (double q = 0.7; q < 0.9; q += 0.01)
    EXPECT_LT(speed_after_strike(striking_rod(q, 1.0)), 6.0) << q;  // it did strike
}

TEST(Restitution, WhatIsWedgedDoesNotBounce) {
  EXPECT_NEAR(speed_after_strike(striking_rod(0.8, 0.0)), 5.0, 1e-3);
  EXPECT_NEAR(speed_after_strike(striking_rod(0.8, 0.0, 0.05)), 0.0, 1e-3);
}

TEST(Restitution, WhatRestsDoesNotBounce) {
  for (const double e : {0.5, 0.9, 1.0}) {
    Simulator sim(test::box_on_plane({.restitution = e}));
    for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
    EXPECT_LT(std::abs(sim.state().v[2]), kSteady) << e;
  }
}

TEST(ExternalWrench, EqualsTheSameGeneralizedForce) {
  Scene scene = test::box_on_plane({.height = 1.0});
  Simulator by_wrench(scene), by_force(scene);
  State start = by_wrench.state();
  start.q.segment<4>(3) << 0.5, 0.5, -0.5, 0.5;
  start.v << 0, 0, 0, 1, 2, 3;
  by_wrench.set_state(start);
  by_force.set_state(start);
  const Vector3 force(1, 2, 3), torque(0.01, -0.02, 0.03);
  by_wrench.input().wrenches.push_back({1, {torque, force}});
  const Matrix3 R = Quaternion(0.5, 0.5, -0.5, 0.5).toRotationMatrix();
  by_force.input().applied_force << force,
      R.transpose() * torque;  // angular coordinates: body axes
  by_wrench.step();
  by_force.step();
  EXPECT_LT((by_wrench.state().v - by_force.state().v).norm(), kRoundoff);
}

TEST(Step, SameInputSameBits) {
  std::vector<double> last;
  for (int repeat = 0; repeat < 2; ++repeat) {
    Simulator sim(test::box_on_plane({.restitution = 0.2, .height = 0.3}));
    State start = sim.state();
    start.v << 1, 0.5, 0, 3, -2, 1;
    sim.set_state(start);
    run(sim, 1.0);
    std::vector<double> now(sim.state().q.begin(), sim.state().q.end());
    now.insert(now.end(), sim.state().v.begin(), sim.state().v.end());
    if (repeat == 1) {
      EXPECT_EQ(now, last);
    }
    last = now;
  }
}

TEST(Step, DoesNotAllocateAfterWarmUp) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim(test::box_on_plane({.height = 0.05}));
  State start = sim.state();
  start.v << 0.5, 0, 0, 1, 2, 3;
  sim.set_state(start);
  // Warm-up: the same fall, so that all sizes have occurred.
  run(sim, 1.0);
  sim.inverse(start.q, start.v, start.v);
  sim.set_state(start);
  const std::size_t before = test::allocation_count();
  run(sim, 1.0);
  const std::size_t stepping = test::allocation_count() - before;
  EXPECT_EQ(stepping, 0u);
  const VectorX q = sim.state().q, v = sim.state().v;
  ASSERT_TRUE(sim.step().succeeded());
  sim.inverse(q, v, sim.state().v);
  const std::size_t before_inverse = test::allocation_count();
  sim.inverse(q, v, sim.state().v);
  EXPECT_EQ(test::allocation_count() - before_inverse, 0u);
}

TEST(Step, NotANumberIsAStatusAndLeavesTheStateAlone) {
  Simulator sim(test::box_on_plane({}));
  const State before = sim.state();
  sim.input().applied_force[0] = std::numeric_limits<double>::quiet_NaN();
  const StepReport report = sim.step();
  EXPECT_FALSE(report.succeeded());
  EXPECT_EQ(report.status, contact::Status::kNotFinite);
  EXPECT_EQ(sim.state().q, before.q);
}

}  // namespace
}  // namespace counterpoint::step_test
