// Friction with two coefficients, along an axis fixed to a surface and across it.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::friction_direction_test {
namespace {

constexpr double kAlong = 0.2, kAcross = 0.6;

Scene load(const std::string& text) {
  const test::TempFolder folder;
  return load_scene(folder.write("scene.yaml", text));
}

/// A flat block of 1 kg on ground with kAlong along x and kAcross along y for this pair.
Scene block(const std::string& model = "coulomb") {
  return load("time_step: 0.001\ncontact: {friction_model: " + model + R"(}
ground: {friction: [0.04, 0.36], friction_axis: [2, 0, 0]}
models:
  - {name: block, box: [0.1, 0.1, 0.01], mass: 1, friction: 1, position: [0, 0, 0.01]}
)");
}

/// The block on a slope of `angle` that descends along `heading` from x [rad].
Scene slope(double angle, double heading) {
  Scene scene = block();
  ModelEditor editor(std::move(scene.model));
  editor.set_gravity(kStandardGravity * Vector3(std::sin(angle) * std::cos(heading),
                                                std::sin(angle) * std::sin(heading),
                                                -std::cos(angle)));
  scene.model = editor.take();
  return scene;
}

TEST(FrictionDirection, APairHasTheGeometricMeansAndTheMoreUnequalAxis) {
  const Material plain{.friction = 0.9};
  const Material wood{.friction = 0.4, .friction_axis = Vector3::UnitX(), .friction_across = 0.1};
  const Material skate{
      .friction = 0.01, .friction_axis = Vector3::UnitY(), .friction_across = 0.81};
  const Material one = combine_materials(wood, plain), both = combine_materials(wood, skate);
  EXPECT_DOUBLE_EQ(one.friction, std::sqrt(0.4 * 0.9));
  EXPECT_DOUBLE_EQ(one.friction_across, std::sqrt(0.1 * 0.9));
  EXPECT_FALSE(one.axis_of_second);
  EXPECT_TRUE(both.axis_of_second);
  EXPECT_EQ(both.friction_axis, skate.friction_axis);
  // Wood counts with the mean sqrt(0.4 0.1) = 0.2 of its coefficients.
  EXPECT_DOUBLE_EQ(both.friction, std::sqrt(0.01 * 0.2));
  EXPECT_DOUBLE_EQ(both.friction_across, std::sqrt(0.81 * 0.2));
}

TEST(FrictionDirection, ABlockSlidesDownWithTheCoefficientOfItsDirection) {
  const double angle = 0.7;
  for (const auto& [heading, mu] : {std::pair(0.0, kAlong), {std::numbers::pi / 2.0, kAcross}}) {
    Simulator sim(slope(angle, heading));
    while (sim.state().time < 0.5) ASSERT_TRUE(sim.step().succeeded());
    const double a = kStandardGravity * (std::sin(angle) - mu * std::cos(angle));
    const Vector3 expected = 0.5 * a * Vector3(std::cos(heading), std::sin(heading), 0.0);
    // The block settles by its overlap in the first steps, which sets it back by nm/s.
    EXPECT_LT((sim.state().v.head<3>() - expected).norm(), 1e-6) << heading;
  }
}

TEST(FrictionDirection, ABlockHoldsAlongOneDirectionAndNotAlongTheOther) {
  const double angle = std::atan(0.4);
  Simulator along(slope(angle, 0.0)), across(slope(angle, std::numbers::pi / 2.0));
  while (along.state().time < 0.5) {
    ASSERT_TRUE(along.step().succeeded());
    ASSERT_TRUE(across.step().succeeded());
  }
  EXPECT_GT(along.state().v[0], 0.1);
  EXPECT_LT(across.state().v.norm(), 1e-6);  // creep
}

// Maximal dissipation on the ellipse: f_i = -mu_i^2 v_i f_N / |(mu_1 v_1, mu_2 v_2)|.
TEST(FrictionDirection, ObliqueFrictionDissipatesMost) {
  Scene scene = block();
  scene.v.head<2>() << 1.0, 1.0;
  Simulator sim(scene);
  int checked = 0;
  while (sim.state().time < 0.1) {
    ASSERT_TRUE(sim.step().succeeded());
    for (const ContactForce& c : sim.last_forces().contacts) {
      const Vector3& v = c.slip;
      const double scaled = std::hypot(kAlong * v.x(), kAcross * v.y());
      const Vector3 force(-kAlong * kAlong * v.x(), -kAcross * kAcross * v.y(), 0.0);
      const double normal = c.force.dot(c.contact.normal);
      const Vector3 expected = normal / scaled * force;
      // The smoothing of the law, 1e-13 m, changes friction by 1e-8 of it.
      EXPECT_LT((c.force - normal * c.contact.normal - expected).norm(), 1e-7 * normal);
      ++checked;
    }
  }
  EXPECT_GE(checked, 400);
}

// The velocity of a skate stays along its axis while its body turns by more than a right angle.
TEST(FrictionDirection, ASkateGoesWhereItPoints) {
  Simulator sim(load(R"(
time_step: 0.001
ground: {friction: 1}
models:
  - {name: skate, box: [0.01, 0.01, 0.01], mass: 1, position: [0, 0, 0.01],
     friction: [0.0001, 0.81], friction_axis: [1, 0, 0], velocity: {linear: [1, 0, 0]}}
)"));
  sim.input().applied_force.setZero(6);
  double worst = 0.0, heading = 0.0, fastest = 0.0;
  while (sim.state().time < 2.0) {
    const State& s = sim.state();
    sim.input().applied_force[5] = 0.02 * (5.0 - s.v[5]);  // turns at about 1 rad/s
    ASSERT_TRUE(sim.step().succeeded());
    heading = 2.0 * std::atan2(sim.state().q[6], sim.state().q[3]);  // q: x y z, then w x y z
    const Vector3 v = sim.state().v.head<3>(), across(-std::sin(heading), std::cos(heading), 0.0);
    fastest = std::max(fastest, sim.state().v[5]);
    worst = std::max(worst, std::abs(v.dot(across)) / v.norm());
  }
  EXPECT_GT(heading, 1.0);
  // The corners slide by s = (mu_1 v, mu_2 omega x) in scaled coordinates, so that friction across
  // resists the drift v_y by mu_2^2 N (mu_1 v)^2 / |s|^3 v_y; it must turn the velocity, m v omega.
  const double s = std::hypot(0.01, 0.9 * fastest * 0.01);
  const double drift = fastest / kStandardGravity * s * s * s / (0.9 * 0.9 * 0.01 * 0.01);
  EXPECT_LT(worst, 1.5 * drift);  // a spinning face has 0.77 of the friction, and v falls below 1
  EXPECT_LT(worst, 0.02);
}

TEST(FrictionDirection, TheInverseRecoversTheForces) {
  for (const char* model : {"convex", "lagged", "coulomb"}) {
    Scene scene = block(model);
    scene.v.head<2>() << 0.3, 0.2;
    scene.v[5] = 0.5;
    Simulator sim(scene);
    test::Random random(3);
    // Larger torques spin the flat block fast; the rounding error is 1e-16 |J||w| / (r h).
    sim.options().contact.compliance = 1e-5;
    EXPECT_LT(test::recover(sim, 300, 0.5, random), test::kRecovered) << model;
  }
}

/// A ball that slides and spins on a box that moves; `ball` and `box` are their frictions.
Scene ball_on_box(const std::string& model, const std::string& box, const std::string& ball) {
  Scene scene = load("time_step: 0.002\nground: {friction: 0}\ncontact: {friction_model: " + model +
                     R"(}
defaults: {static_friction: 0.9, stribeck_speed: 0.5}
models:
  - {name: box, box: [0.3, 0.2, 0.1], mass: 2, position: [0, 0, 0.0999], )" +
                     box + R"(,
     velocity: {linear: [0.2, 0.1, 0], angular: [0, 0, 0.3]}}
  - {name: ball, sphere: 0.1, mass: 1, position: [0.02, 0.03, 0.2998], rpy: [0.2, 0.4, 0.1], )" +
                     ball + R"(,
     velocity: {linear: [0.1, -0.2, 0], angular: [1, 0.5, 0.7]}}
)");
  test::soften(scene);
  return scene;
}

TEST(FrictionDirection, DerivativesContainTheRotationOfTheFrame) {
  const std::string plain = "friction: 0.7",
                    axis = "friction: [0.2, 0.7], friction_axis: [1, 0.5, 0.3]",
                    other = "friction: [0.7, 0.3], friction_axis: [1, 0.5, 0.3]";
  for (const char* model : {"convex", "lagged", "coulomb"}) {
    for (const auto& [box, ball] : {std::pair(plain, axis), {axis, plain}, {other, plain}}) {
      const Scene scene = ball_on_box(model, box, ball);
      test::expect_exact(scene, test::moment_of(scene, 3), model + box, false, 1e-6);
    }
  }
}

// A ball on the ground: the axis turns with the only body that moves, or stands still.
TEST(FrictionDirection, DerivativesOfABallOnTheGround) {
  for (const bool of_ground : {true, false}) {
    const std::string axis = "friction: [0.2, 0.7], friction_axis: [1, 0.5, 0.3]",
                      plain = "friction: 0.7";
    Scene scene = load("ground: {" + (of_ground ? axis : plain) +
                       "}\nmodels: [{name: ball, sphere: 0.1, mass: 1, position: [0, 0, 0.0999], " +
                       (of_ground ? plain : axis) +
                       ", rpy: [0.2, 0.4, 0.1], velocity: {linear: [0.3, -0.2, 0], "
                       "angular: [1, 0.5, 0.7]}}]");
    test::soften(scene);
    test::expect_exact(scene, test::moment_of(scene, 3), std::to_string(of_ground), false, 1e-6);
  }
}

TEST(FrictionDirection, WhereTheAxisIsAlongTheNormalTheMeanActs) {
  Scene scene = load(R"(
time_step: 0.001
ground: {friction: [0.04, 0.36], friction_axis: [0, 0, 1]}
models:
  - {name: block, box: [0.1, 0.1, 0.01], mass: 1, friction: 1, position: [0, 0, 0.01],
     velocity: {linear: [1, 1, 0]}}
)");
  Simulator sim(scene);
  while (sim.state().time < 0.1) ASSERT_TRUE(sim.step().succeeded());
  const double lost = std::sqrt(0.2 * 0.6) * kStandardGravity * 0.1;
  EXPECT_NEAR(sim.state().v.head<2>().norm(), std::sqrt(2.0) - lost, 1e-6);
}

TEST(FrictionDirection, SwitchedOffItIsTheMean) {
  Scene scene = block();
  scene.options.effects.set(Effect::kFrictionDirections, false);
  scene.v[1] = 1.0;
  Simulator sim(scene);
  while (sim.state().time < 0.1) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[1], 1.0 - std::sqrt(kAlong * kAcross) * kStandardGravity * 0.1, 1e-6);
}

TEST(FrictionDirection, WrongKeysAreRefused) {
  const auto ground = [](const std::string& surface) {
    return load("ground: " + surface + "\nmodels: [{name: b, sphere: 1, mass: 1}]");
  };
  EXPECT_NO_THROW(ground("{friction: [0.3, 0.5], friction_axis: [1, 1, 0]}"));
  EXPECT_THROW(ground("{friction: [0.3, 0.5]}"), InputError);
  EXPECT_THROW(ground("{friction: [0.3, 0], friction_axis: [1, 0, 0]}"), InputError);
  EXPECT_THROW(ground("{friction: [0.3, 0.5, 1], friction_axis: [1, 0, 0]}"), InputError);
  EXPECT_THROW(ground("{friction: 0.3, friction_axis: [1, 0, 0]}"), InputError);
  EXPECT_THROW(ground("{friction_axis: [1, 0, 0]}"), InputError);
  EXPECT_THROW(ground("{friction: [0.3, 0.5], friction_axis: [0, 0, 0]}"), InputError);
}

}  // namespace
}  // namespace counterpoint::friction_direction_test
