// Surfaces that move on their bodies: belts that carry, tracks that drive.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"
#include "support/paths.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::surface_motion_test {
namespace {

constexpr double kG = kStandardGravity, kStep = 0.001;  // [m/s^2], [s]

Scene load(const std::string& text) {
  const test::TempFolder folder;
  return load_scene(folder.write("scene.yaml", fmt::format("time_step: {}\n{}", kStep, text)));
}

/// A cube of 0.2 m and 2 kg on a belt along x.
Scene on_belt(double speed, double friction, const std::string& more = "") {
  return load(fmt::format(R"({}
ground: {{friction: {}, surface_velocity: [{}, 0, 0]}}
models: [{{name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [0, 0, 0.1], friction: {}}}]
)",
                          more, friction, speed, friction));
}

// A box that is put on a belt is dragged with mu g until it has the speed of the belt.
TEST(SurfaceMotion, ABeltDragsABoxUpToItsSpeed) {
  constexpr double kSpeed = 0.5, kFriction = 0.3;
  constexpr double kStepOff = kFriction * kG * kStep;  // the lagged law's last step of sliding
  for (const char* model : {"coulomb", "lagged", "convex"}) {
    Simulator sim(
        on_belt(kSpeed, kFriction, fmt::format("contact: {{friction_model: {}}}", model)));
    double farthest_off = 0.0;
    while (sim.state().time < 0.5) {
      ASSERT_TRUE(sim.step().succeeded());
      const double expected = std::min(kFriction * kG * sim.state().time, kSpeed);
      farthest_off = std::max(farthest_off, std::abs(sim.state().v[0] - expected));
    }
    // The convex law throws a sliding box up with mu |v_T|; it is dragged again when it lands.
    if (std::string(model) != "convex") {
      EXPECT_LT(farthest_off, std::string(model) == "lagged" ? kStepOff : 1e-5) << model;
    }
    EXPECT_NEAR(sim.state().v[0], kSpeed, 1e-6) << model;
  }
}

// On a belt that runs up a slope a box rides if mu > tan(angle); otherwise it slips back.
TEST(SurfaceMotion, ABeltCarriesABoxUpASlope) {
  constexpr double kAngle = 0.3, kSpeed = 0.4;
  for (const double friction : {0.5, 0.2}) {
    Simulator sim(load(fmt::format(R"(
environment:
  - {{name: belt, box: [5, 1, 0.1], position: [0, 0, -0.1], rpy: [0, {}, 0], friction: {},
     surface_velocity: [{}, 0, 0]}}
models:
  - {{name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [{}, 0, {}], rpy: [0, {}, 0],
     friction: {}, velocity: {{linear: [{}, 0, {}]}}}}
)",
                                   -kAngle, friction, kSpeed, -0.2 * std::sin(kAngle),
                                   -0.1 + 0.2 * std::cos(kAngle), -kAngle, friction,
                                   kSpeed * std::cos(kAngle), kSpeed * std::sin(kAngle))));
    while (sim.state().time < 0.3) ASSERT_TRUE(sim.step().succeeded());
    const double along = std::cos(kAngle) * sim.state().v[0] + std::sin(kAngle) * sim.state().v[2];
    const double slides =
        std::max(kG * (std::sin(kAngle) - friction * std::cos(kAngle)), 0.0) * sim.state().time;
    EXPECT_NEAR(along, kSpeed - slides, 1e-4) << friction;
  }
}

// A body on a track that runs backwards at V drives forwards at V; the contacts do not slip then.
TEST(SurfaceMotion, ATrackDrivesItsBody) {
  constexpr double kSpeed = 0.7;
  Simulator sim(load(fmt::format(R"(
ground: {{friction: 0.6}}
models:
  - {{name: crawler, box: [0.3, 0.2, 0.1], mass: 20, position: [0, 0, 0.1], rpy: [0, 0, 0.5],
     friction: 0.6, surface_velocity: [{}, 0, 0]}}
)",
                                 -kSpeed)));
  while (sim.state().time < 1.0) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], kSpeed * std::cos(0.5), 1e-6);
  EXPECT_NEAR(sim.state().v[1], kSpeed * std::sin(0.5), 1e-6);
  for (const auto& contact : sim.last_forces().contacts) EXPECT_LT(contact.slip.norm(), 1e-6);
}

// A free body with a belt that drags another one is pushed back: momentum is kept.
TEST(SurfaceMotion, ABeltPushesItsBodyBack) {
  Simulator sim(load(R"(
ground: {friction: 0}
models:
  - {name: cart, box: [1, 0.3, 0.1], mass: 10, position: [0, 0, 0.1], friction: 0.4,
     surface_velocity: [1, 0, 0]}
  - {name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [0, 0, 0.3], friction: 0.4}
)"));
  while (sim.state().time < 1.0) ASSERT_TRUE(sim.step().succeeded());
  const double cart = sim.state().v[0], box = sim.state().v[6];
  EXPECT_NEAR(box - cart, 1.0, 1e-5);
  EXPECT_NEAR(10.0 * cart + 2.0 * box, 0.0, 1e-9);
}

TEST(SurfaceMotion, TheInverseRecoversTheForces) {
  // Rounding of the box's speed over the regularizer, 0.5 m/s * 1e-16 / (1e-6 / 2 kg) / 1 ms, is
  // 1e-7 N, 5e-9 of its weight.
  constexpr double kRounding = 5e-9;
  for (const char* model : {"coulomb", "lagged", "convex"}) {
    Simulator sim(on_belt(0.5, 0.4, fmt::format("contact: {{friction_model: {}}}", model)));
    test::Random random(3);
    EXPECT_LT(test::recover(sim, 400, 4.0, random), kRounding) << model;
  }
}

// A velocity along the normal is not that of a surface.
TEST(SurfaceMotion, TheNormalPartDoesNotCount) {
  Scene scene = on_belt(0.0, 0.4);
  ModelBuilder builder;
  Material up;
  up.surface_velocity = Vector3(0.0, 0.0, 3.0);
  builder.add_environment("ground", {ShapeType::kPlane, Vector3::Zero(), nullptr}, Pose(), up);
  Pose above;
  above.translation.z() = 0.1;
  builder.add_robot(
      object_of("box", {ShapeType::kBox, Vector3::Constant(0.1), nullptr}, 2.0, Material()),
      Base::kFloating, above);
  scene.model = builder.build();
  Simulator sim(scene);
  while (sim.state().time < 0.1) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_LT(sim.state().v.norm(), 1e-9);
}

TEST(SurfaceMotion, DerivativesAreThoseOfDifferences) {
  Scene scene = on_belt(0.5, 0.4);
  test::soften(scene);
  Simulator sim(scene);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(sim.step().succeeded());
  const VectorX q = sim.state().q, v = sim.state().v;
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_FALSE(test::expect_exact(scene, {q, v, sim.state().v, {}}, "belt", true, 1e-7));
}

TEST(SurfaceMotion, OnlyShapesHaveIt) {
  for (const char* text : {"defaults: {surface_velocity: [1, 0, 0]}\nground: {}",
                           "ground: {}\nmodels: [{name: a, sphere: 1, mass: 1}]\n"
                           "pairs: [{between: [ground, a/body], surface_velocity: [1, 0, 0]}]",
                           "ground: {surface_velocity: 1}"})
    EXPECT_THROW(load(text), InputError) << text;
}

}  // namespace
}  // namespace counterpoint::surface_motion_test
