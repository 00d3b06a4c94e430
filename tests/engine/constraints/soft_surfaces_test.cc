// Surfaces with a stiffness: a spring with a linear damper, or Hunt and Crossley's, at each
// contact.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::soft_surfaces_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr const char* kIntegrators[] = {"semi_implicit_euler", "implicit_midpoint"};

Scene scene_of(const std::string& text) {
  const test::TempFolder folder;
  return load_scene(folder.write("scene.yaml", text));
}

/// A ball of 1 kg and 0.1 m on hard, smooth ground: its own surface yields. `height`: of its lowest
/// point [m].
Scene ball(const std::string& surface, const std::string& integrator, double h, double height,
           double speed, double gravity) {
  return scene_of(fmt::format(R"(
time_step: {}
integrator: {}
gravity: [0, 0, {}]
ground: {{friction: 0}}
models:
  - {{name: ball, sphere: 0.1, mass: 1, position: [0, 0, {}], friction: 0, {},
     velocity: {{linear: [0, 0, {}]}}}}
)",
                              h, integrator, -gravity, 0.1 + height, surface, speed));
}

constexpr double kNothing = 1e-3;  ///< force of the smoothing about the corner of the law [N]

struct Bounced {
  double time = 0.0;   ///< in contact [s]
  double speed = 0.0;  ///< after it [m/s]
};

/// Lets a ball fly at 1 m/s against the ground.
Bounced bounce(const std::string& surface, const std::string& integrator, double h) {
  Simulator sim(ball(surface, integrator, h, 0.37 * h, -1.0, 0.0));
  Bounced out;
  for (bool touched = false; sim.state().time < 1.0;) {
    EXPECT_TRUE(sim.step().succeeded());
    const bool touches = !sim.last_forces().contacts.empty() &&
                         sim.last_forces().contacts[0].force.norm() > kNothing;
    if (touches) out.time += h;
    if (touched && !touches) break;
    touched = touched || touches;
  }
  out.speed = sim.state().v[2];
  return out;
}

TEST(SoftSurfaces, TwoSpringsAreInSeries) {
  const Material hard{}, a{.stiffness = 2e4, .damping = 8.0, .dissipation = 0.9},
      b{.stiffness = 6e4, .damping = 16.0};
  EXPECT_FALSE(combine_materials(hard, hard).is_soft());
  const Material alone = combine_materials(hard, a), both = combine_materials(a, b);
  EXPECT_EQ(alone.stiffness, 2e4);
  EXPECT_EQ(alone.damping, 8.0);
  EXPECT_EQ(alone.dissipation, 0.9);
  EXPECT_DOUBLE_EQ(both.stiffness, 1.5e4);
  // The surfaces take 3 / 4 and 1 / 4 of the deformation.
  EXPECT_DOUBLE_EQ(both.damping, 8.0 * 9.0 / 16.0 + 16.0 / 16.0);
  EXPECT_DOUBLE_EQ(both.dissipation, 0.9 * 9.0 / 16.0);
  // Two equal dampers in series are half as strong.
  EXPECT_DOUBLE_EQ(combine_materials(a, a).damping, 4.0);
  const Material bouncy{.restitution = 0.5};
  EXPECT_EQ(combine_materials(a, bouncy).restitution, 0.0);
}

// A load F presses a spring by F / k.
TEST(SoftSurfaces, YieldByTheLoadOverTheStiffness) {
  for (const char* integrator : kIntegrators) {
    for (const double k : {1e3, 1e5}) {
      const double depth = kStandardGravity / k;
      const std::string surface = fmt::format("stiffness: {}, damping: {}", k, std::sqrt(k));
      Simulator sim(ball(surface, integrator, 0.002, -depth * 1.2, 0.0, kStandardGravity));
      while (sim.state().time < 4.0) ASSERT_TRUE(sim.step().succeeded());
      // Smoothing lifts the ball by 1e-13 m, and by twice that in the middle of a step.
      EXPECT_NEAR(0.1 - sim.state().q[2], depth, 1e-9 * depth + 2.5e-13) << integrator << k;
    }
  }
}

// Kelvin and Voigt's contact pulls at no time, and ends where the force is zero: with w^2 = k / m,
// z = c / (2 sqrt(k m)) < 1 / sqrt(2) and w_d = w sqrt(1 - z^2), after
//   t = (pi - atan(2 z sqrt(1 - z^2) / (1 - 2 z^2))) / w_d      at the speed exp(-z w t)
// (Schwager and Poeschel 2007, "Coefficient of restitution and linear-dashpot model revisited").
TEST(SoftSurfaces, ABallBouncesByTheClosedFormOfALinearDamper) {
  constexpr double k = 1e4, w = 100.0;
  for (const double z : {0.0, 0.05, 0.3}) {
    const double root = std::sqrt(1.0 - z * z);
    const double time = (kPi - std::atan2(2.0 * z * root, 1.0 - 2.0 * z * z)) / (w * root);
    const double speed = std::exp(-z * w * time);
    const std::string surface = fmt::format("stiffness: {}, damping: {}", k, 2.0 * z * w);
    for (const double h : {1e-4, 2.5e-5}) {
      for (const char* integrator : kIntegrators) {
        const Bounced found = bounce(surface, integrator, h);
        EXPECT_NEAR(found.time, time, 2.0 * h) << z;  // whole steps
        // The numerical damping is that of a ratio w h / 2. The damper begins with a jump of its
        // force within a step.
        EXPECT_NEAR(found.speed, speed, kPi * (0.5 * w * h) + 2.0 * z * w * h) << z;
        EXPECT_LE(found.speed, 1.0);
      }
    }
  }
}

// Hunt and Crossley's F = k d (1 + x d') gives the speed u after an impact at v by
//   v / x - log(1 + x v) / x^2 = -u / x - log(1 - x u) / x^2,
// whatever the stiffness: v dv / (1 + x v) is the same over both halves.
TEST(SoftSurfaces, ABallBouncesByTheClosedFormOfHuntAndCrossley) {
  for (const double x : {0.05, 0.3, 1.0}) {
    const auto half = [&](double v) { return v / x - std::log1p(x * v) / (x * x); };
    double low = 0.0, high = std::min(1.0, 1.0 / x);
    for (int i = 0; i < 60; ++i) {
      const double u = 0.5 * (low + high);
      (half(-u) < half(1.0) ? low : high) = u;
    }
    for (const double k : {1e4, 1e6}) {
      const double h = 1e-3 / std::sqrt(k), w = std::sqrt(k);  // 3000 steps a bounce
      const std::string surface = fmt::format("stiffness: {}, dissipation: {}", k, x);
      // The overlap at the start of the step is late by h / 2 of a motion in pi / w.
      for (const char* integrator : kIntegrators)
        EXPECT_NEAR(bounce(surface, integrator, h).speed, low, kPi * w * h) << x;
    }
  }
}

// A block on four corners: vertical period 2 pi sqrt(m / 4k).
TEST(SoftSurfaces, ABlockOnFourCornersSwingsByItsMassOverFourSprings) {
  constexpr double k = 2500.0, m = 1.0, h = 1e-4;
  const double depth = m * kStandardGravity / (4.0 * k), w = std::sqrt(4.0 * k / m);
  Simulator sim(scene_of(fmt::format(R"(
time_step: {}
integrator: implicit_midpoint
ground: {{friction: 0}}
models:
  - {{name: block, box: [0.2, 0.2, 0.1], mass: {}, position: [0, 0, {}], friction: 0, stiffness: {}}}
)",
                                     h, m, 0.1 - 1.5 * depth, k)));
  std::vector<double> tops;
  double last = sim.state().v[2];
  while (sim.state().time < 1.5) {
    ASSERT_TRUE(sim.step().succeeded());
    const double v = sim.state().v[2];
    if (last > 0.0 && v <= 0.0) tops.push_back(sim.state().time - h * v / (v - last));
    last = v;
  }
  ASSERT_GT(tops.size(), 20u);
  const double period = (tops.back() - tops.front()) / static_cast<double>(tops.size() - 1);
  // Numerical damping of the ratio w h / 2 lengthens the period by (w h)^2 / 8.
  EXPECT_NEAR(period, 2.0 * kPi / w, 2.0 * kPi / w * (w * h * w * h + 1e-5));
}

// A soft base carries ten hard boxes, of which each presses by its weight.
TEST(SoftSurfaces, AStackOfTenRestsOnASoftBase) {
  constexpr double k = 5e3;
  std::string text = "time_step: 0.002\nground: {stiffness: 5000, damping: 100}\nmodels:\n";
  for (int i = 0; i < 10; ++i)
    text += fmt::format("  - {{name: b{}, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, {}]}}\n",
                        i, 0.1 + 0.2 * i);
  Simulator sim(scene_of(text));
  while (sim.state().time < 6.0) ASSERT_TRUE(sim.step().succeeded());
  const double depth = 10.0 * kStandardGravity / (4.0 * k);
  EXPECT_NEAR(0.1 - sim.state().q[2], depth, 1e-7);
  EXPECT_NEAR(1.9 - sim.state().q[7 * 9 + 2], depth, 1e-6);  // hard contacts between them
  EXPECT_LT(sim.state().v.cwiseAbs().maxCoeff(), 1e-6);
}

/// Energy of the ball and of its spring [J].
double energy(const Simulator& sim, double k, double gravity) {
  const double depth = std::max(0.1 - sim.state().q[2], 0.0);
  return 0.5 * sim.state().v.squaredNorm() + gravity * sim.state().q[2] + 0.5 * k * depth * depth;
}

// With c' >= h k no step gains energy, from the smallest to the largest stiffness and step, and a
// ball that flies against the surface comes back no faster.
TEST(SoftSurfaces, GainNoEnergyAtAnyStiffnessAndStep) {
  for (const char* integrator : kIntegrators) {
    for (const double k : {1e2, 1e4, 1e6, 1e9}) {
      for (const double h : {1e-4, 2e-3, 2e-2}) {
        for (const double x : {0.0, 0.5}) {
          const std::string surface = fmt::format("stiffness: {}, dissipation: {}", k, x);
          Simulator sim(ball(surface, integrator, h, 0.013, -1.3, 0.0));
          const double start = energy(sim, k, 0.0);
          for (int i = 0; i < 2000 && sim.state().time < 1.0; ++i) {
            ASSERT_TRUE(sim.step().succeeded());
            // Between steps of the midpoint rule part of the energy of an opening is in the spring.
            ASSERT_LE(0.5 * sim.state().v.squaredNorm(), start * (1.0 + 1e-9))
                << integrator << ' ' << k << ' ' << h << ' ' << x;
          }
        }
      }
    }
  }
}

// A box that starts in the ground by 5 mm has the energy of its springs, and no more.
TEST(SoftSurfaces, AnOverlapHoldsTheEnergyOfItsSprings) {
  for (const char* integrator : kIntegrators) {
    constexpr double k = 1e5, depth = 0.005;
    Simulator sim(ball(fmt::format("stiffness: {}", k), integrator, 1e-4, -depth, 0.0, 0.0));
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
    const double all = std::sqrt(k) * depth;
    EXPECT_LE(sim.state().v[2], all * (1.0 + 1e-9));
    EXPECT_GE(sim.state().v[2], 0.95 * all);  // numerical damping: pi / 4 w h of it
  }
}

/// A box that tumbles over another one, both soft, under friction.
Scene tumbling(const char* integrator, const char* friction) {
  return scene_of(fmt::format(R"(
time_step: 0.002
integrator: {}
contact: {{friction_model: {}}}
ground: {{friction: 0.7}}
defaults: {{friction: 0.6, stiffness: 2.0e+4, damping: 20, dissipation: 0.4}}
models:
  - {{name: low, box: [0.3, 0.3, 0.1], mass: 2, position: [0, 0, 0.0499],
     velocity: {{linear: [0.2, 0.1, 0], angular: [0, 0, 0.3]}}}}
  - {{name: top, box: [0.1, 0.15, 0.2], mass: 1, position: [0.02, 0.03, 0.2], rpy: [0.2, 0.4, 0.1],
     velocity: {{linear: [0.1, -0.2, 0], angular: [1, 0.5, 0.7]}}}}
)",
                              integrator, friction));
}

TEST(SoftSurfaces, TheInverseRecoversTheForces) {
  for (const char* friction : {"convex", "coulomb"}) {
    Simulator sim(tumbling("semi_implicit_euler", friction));
    test::Random random(5);
    EXPECT_LT(test::recover(sim, 400, 8.0, random), test::kRecovered) << friction;
  }
  // Under the midpoint rule poses give the contact velocity.
  Simulator sim(tumbling("implicit_midpoint", "coulomb"));
  double error = 0.0, scale = 0.0;
  for (int i = 0; i < 400; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& found = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
    error = std::max(error, found.applied_force.cwiseAbs().maxCoeff());
    scale = std::max(scale, found.force_scale);
  }
  EXPECT_LT(error, test::kRecovered * scale);
}

TEST(SoftSurfaces, DerivativesAreExact) {
  for (const char* friction : {"convex", "lagged", "coulomb"}) {
    Scene scene = tumbling("semi_implicit_euler", friction);
    test::soften(scene);
    test::expect_exact(scene, test::moment_of(scene, 30), friction, false, 1e-6);
  }
}

TEST(SoftSurfaces, SwitchedOffTheyAreHard) {
  Scene soft = ball("stiffness: 1.0e+4", "semi_implicit_euler", 0.002, 0.01, 0.0, 9.8);
  const Scene hard = ball("restitution: 0", "semi_implicit_euler", 0.002, 0.01, 0.0, 9.8);
  soft.options.effects.set(Effect::kStiffness, false);
  Simulator a(soft), b(hard);
  for (int i = 0; i < 200; ++i) {
    a.step();
    b.step();
    ASSERT_EQ(a.state().q, b.state().q);
  }
}

TEST(SoftSurfaces, SettingsThatWouldDoNothingAreRefused) {
  const auto load = [](const std::string& surface) {
    return scene_of("ground: {" + surface + "}\nmodels: [{name: b, sphere: 1, mass: 1}]");
  };
  EXPECT_NO_THROW(load("stiffness: 1.0e+4, damping: 3"));
  EXPECT_THROW(load("damping: 3"), InputError);
  EXPECT_THROW(load("dissipation: 3"), InputError);
  EXPECT_THROW(load("stiffness: 0"), InputError);
  EXPECT_THROW(load("stiffness: -1"), InputError);
  EXPECT_THROW(load("stiffness: 1.0e+4, damping: -1"), InputError);
  EXPECT_THROW(load("stiffness: 1.0e+4, restitution: 0.5"), InputError);
}

}  // namespace
}  // namespace counterpoint::soft_surfaces_test
