// Static friction above that of sliding: mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::static_friction_test {
namespace {

constexpr double kStatic = 0.6, kKinetic = 0.4;

/// A flat block of 1 kg that slides at `speed` [m/s] along x down a slope of this angle [rad].
Scene block(double angle, double speed, double stribeck_speed, const std::string& options = "") {
  const test::TempFolder folder;
  Scene scene = load_scene(folder.write("block.yaml", options + R"(
time_step: 0.001
ground: {}
defaults: {friction: 0.4, static_friction: 0.6, stribeck_speed: )" +
                                                          std::to_string(stribeck_speed) + R"(}
models:
  - {name: block, box: [0.1, 0.1, 0.01], mass: 1, position: [0, 0, 0.01]}
)"));
  ModelEditor editor(std::move(scene.model));
  editor.set_gravity(kStandardGravity * Vector3(std::sin(angle), 0.0, -std::cos(angle)));
  scene.model = editor.take();
  scene.v[0] = speed;
  return scene;
}

/// Speed along x [m/s] after `seconds`.
double speed_after(Scene scene, double seconds) {
  Simulator sim(std::move(scene));
  while (sim.state().time < seconds) EXPECT_TRUE(sim.step().succeeded());
  return sim.state().v[0];
}

TEST(StaticFriction, CombinesLikeFriction) {
  const Material plain{.friction = 0.9}, sticky{.friction = 0.4, .static_friction = 0.6};
  EXPECT_EQ(combine_materials(plain, plain).static_friction, 0.0);
  EXPECT_DOUBLE_EQ(combine_materials(sticky, sticky).static_friction, 0.6);
  EXPECT_DOUBLE_EQ(combine_materials(plain, sticky).friction, std::sqrt(0.9 * 0.4));
  EXPECT_DOUBLE_EQ(combine_materials(plain, sticky).static_friction, std::sqrt(0.9 * 0.6));
  const Material slick{.friction = 0.0};
  EXPECT_EQ(combine_materials(slick, sticky).friction_at_rest(), 0.0);
}

TEST(StaticFriction, ItsSlopesAreThoseOfTheCurve) {
  const Material m{.friction = 0.4, .static_friction = 0.6, .stribeck_speed = 0.02};
  for (const double v : {0.0, 0.005, 0.02, 0.07}) {
    const double step = 1e-6;
    const double by_speed =
        (sliding_friction(m, v + step).value - sliding_friction(m, v - step).value) / (2 * step);
    // The error of the difference is that of the third derivative, 1e5 s^3/m^3, times step^2 / 6.
    EXPECT_NEAR(sliding_friction(m, v).by_speed, by_speed, 1e-6);
    Material other = m;
    other.stribeck_speed += step;
    const double by_stribeck =
        (sliding_friction(other, v).value - sliding_friction(m, v).value) / step;
    EXPECT_NEAR(sliding_friction(m, v).by_stribeck_speed, by_stribeck, 2e-3);  // 600 s^2/m^2 step
  }
}

// At rest the block holds up to tan(theta) = mu_s. Between mu_k and mu_s it stays as it is: at
// rest, or sliding with the acceleration g (sin - mu_k cos).
TEST(StaticFriction, ABlockStartsWhereStaticFrictionEndsAndStopsWhereSlidingFrictionHolds) {
  constexpr double kSpeed = 0.001;  // [m/s] Stribeck speed
  // Creep by the slip speed and the compliance is below 1e-7 m/s.
  EXPECT_LT(speed_after(block(std::atan(0.99 * kStatic), 0.0, kSpeed), 1.0), 1e-6);
  const double steep = std::atan(1.01 * kStatic), between = std::atan(0.5 * (kStatic + kKinetic));
  EXPECT_GT(speed_after(block(steep, 0.0, kSpeed), 1.0), 0.5);
  const double a = kStandardGravity * (std::sin(between) - kKinetic * std::cos(between));
  // At 0.1 m/s static friction is gone. Slip of exact friction shows in no digit given here.
  EXPECT_NEAR(speed_after(block(between, 0.1, kSpeed), 1.0), 0.1 + a, 1e-6);
  EXPECT_LT(speed_after(block(std::atan(0.99 * kKinetic), 0.02, kSpeed), 1.0), 1e-6);
}

// A slope that tilts slowly: the block starts at mu_s, is fastest at mu_k as the slope tilts back,
// comes to rest, and does not start again below mu_s.
TEST(StaticFriction, ASlopeThatTiltsSlowlyReleasesABlockAtOneAngleAndStopsItAtAnother) {
  constexpr double kSpeed = 0.001;         // [m/s] Stribeck speed
  Simulator sim(block(0.0, 0.0, kSpeed));  // level; a force tilts the weight of 1 kg
  double angle = std::atan(0.95 * kStatic);
  const auto step = [&](double rate) {
    angle += rate * 0.001;
    VectorX force = VectorX::Zero(6);
    force[0] = kStandardGravity * std::sin(angle);
    force[2] = kStandardGravity * (1.0 - std::cos(angle));
    sim.input().applied_force = force;
    EXPECT_TRUE(sim.step().succeeded());
    return sim.state().v[0];
  };
  while (step(0.02) < kSpeed && std::tan(angle) < kStatic + 0.1) {
  }
  // Friction of 0.6 gives way over some steps, in which the slope tilts by 2e-5 rad each.
  EXPECT_NEAR(std::tan(angle), kStatic, 1e-3);
  double fastest = 0.0, at = 0.0;
  for (double v = step(-0.2); v > 1e-6; v = step(-0.2)) {
    if (v <= fastest) continue;
    fastest = v;
    at = angle;
  }
  EXPECT_NEAR(std::tan(at), kKinetic, 1e-3);  // 2e-4 rad a step
  EXPECT_LT(std::tan(angle), kKinetic);
  while (std::tan(angle) < 0.98 * kStatic) ASSERT_LT(step(0.2), 1e-6);
}

// A spring pulls the block at constant speed. For v_s -> 0 the extension of the spring swings about
// mu_k N / k with A = (mu_s - mu_k) N / k while the block slides, until the block is at rest again.
TEST(StaticFriction, ABlockOnASpringSticksAndSlips) {
  constexpr double kStiffness = 100.0, kPull = 0.01, kMass = 1.0;  // [N/m], [m/s], [kg]
  Scene scene = block(0.0, 0.0, 2e-5);
  constexpr double kStep = 1e-4;
  scene.options.time_step = kStep;
  // Smoothing makes the block creep by some um/s just below the bound, not far below v_s.
  scene.options.contact.smoothing = 0.0;
  Simulator sim(std::move(scene));
  sim.input().applied_force.setZero(6);
  const double w = std::sqrt(kStiffness / kMass), load = kMass * kStandardGravity;
  const double A = (kStatic - kKinetic) * load / kStiffness;
  std::vector<double> starts;
  double longest = 0.0, work = 0.0;
  bool slides = false;
  while (starts.size() < 4 && sim.state().time < 20.0) {
    const double stretch = kPull * sim.state().time - sim.state().q[0];
    longest = std::max(longest, stretch);
    sim.input().applied_force[0] = kStiffness * stretch;
    ASSERT_TRUE(sim.step().succeeded());
    for (const ContactForce& c : sim.last_forces().contacts)
      work = std::max(work, c.force.dot(c.slip));
    const bool moves = sim.state().v[0] > 0.1 * A * w;
    if (moves && !slides) starts.push_back(sim.state().time);
    slides = moves;
  }
  ASSERT_EQ(starts.size(), 4u);
  const double period = 2.0 * A / kPull + 2.0 / w * (std::numbers::pi - std::atan(A * w / kPull));
  // A step more or less at either end, and the time to pass v_s: the block leaves v = 0 as
  // exp(t (mu_s - mu_k) g / v_s) at most, within a few ms.
  EXPECT_NEAR((starts[3] - starts[1]) / 2.0, period, 0.002 * period);
  EXPECT_NEAR(longest, kKinetic * load / kStiffness + std::hypot(A, kPull / w), 0.005 * A);
  EXPECT_LE(work, 0.0);  // friction opposes the motion at the end of the step
}

TEST(StaticFriction, TheInverseRecoversTheForcesOfSlidingAndSticking) {
  for (const char* model : {"convex", "lagged", "coulomb"}) {
    Simulator sim(block(0.0, 0.05, 0.03, "contact: {friction_model: " + std::string(model) + "}"));
    test::Random random(3);
    // Larger torques spin the flat block fast; the rounding error is 1e-16 |J||w| / (r h).
    sim.options().contact.compliance = 1e-5;
    EXPECT_LT(test::recover(sim, 300, 0.5, random), test::kRecovered) << model;
  }
}

/// A ball that slides and spins at about the Stribeck speed, on a box that moves.
Scene ball_on_box(const char* model) {
  const test::TempFolder folder;
  Scene scene = load_scene(folder.write("ball.yaml", R"(
time_step: 0.002
ground: {}
defaults: {friction: 0.4, static_friction: 0.7, stribeck_speed: 0.3}
contact: {friction_model: )" + std::string(model) +
                                                         R"(}
models:
  - {name: box, box: [0.3, 0.2, 0.1], mass: 2, position: [0, 0, 0.0999],
     velocity: {linear: [0.2, 0.1, 0], angular: [0, 0, 0.3]}}
  - {name: ball, sphere: 0.1, mass: 1, position: [0.02, 0.03, 0.2998], rpy: [0.2, 0.4, 0.1],
     velocity: {linear: [0.1, -0.2, 0], angular: [1, 0.5, 0.7]}}
)"));
  test::soften(scene);
  return scene;
}

TEST(StaticFriction, DerivativesAreExact) {
  for (const char* model : {"convex", "lagged", "coulomb"}) {
    const Scene scene = ball_on_box(model);
    test::expect_exact(scene, test::moment_of(scene, 3), model, false, 1e-6);
  }
}

/// Largest difference of the states of two runs of half a second.
double apart(const Scene& a, const Scene& b) {
  Simulator one(a), other(b);
  for (int k = 0; k < 500; ++k) {
    one.step();
    other.step();
  }
  return (one.state().q - other.state().q).cwiseAbs().maxCoeff();
}

TEST(StaticFriction, WithoutExcessOrSwitchedOffItChangesNoBit) {
  Scene with = block(0.3, 0.05, 0.02);
  Scene without = with;
  ModelEditor editor(std::move(without.model));
  for (int g = 0; g < 2; ++g) editor.set_material(g, {.friction = kKinetic});
  without.model = editor.take();
  EXPECT_GT(apart(with, without), 0.0);
  with.options.effects.set(Effect::kStaticFriction, false);
  EXPECT_EQ(apart(with, without), 0.0);
}

TEST(StaticFriction, BelowThatOfSlidingIsRefused) {
  const test::TempFolder folder;
  const auto load = [&](const std::string& surface) {
    return load_scene(folder.write(
        "scene.yaml", "ground: " + surface + "\nmodels: [{name: b, sphere: 1, mass: 1}]"));
  };
  EXPECT_NO_THROW(load("{friction: 0.3, static_friction: 0.3}"));
  EXPECT_THROW(load("{friction: 0.5, static_friction: 0.3}"), InputError);
  EXPECT_THROW(load("{friction: 0, static_friction: 0.3}"), InputError);
  EXPECT_THROW(load("{friction: 0.3, static_friction: 0.5, stribeck_speed: 0}"), InputError);
}

}  // namespace
}  // namespace counterpoint::static_friction_test
