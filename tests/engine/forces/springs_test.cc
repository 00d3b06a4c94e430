// Springs in joints against implicit Euler worked out by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/small_scenes.h"

namespace counterpoint::springs_test {
namespace {

/// A few hundred roundings of numbers of order one.
constexpr double kRoundoff = 1e-12;

TEST(Springs, OscillatorHasThePeriodAndDecayOfImplicitEuler) {
  const double mass = 2.0, stiffness = 50.0, reference = 0.3, start = 1.0;
  for (const double h : {1e-4, 1e-3, 1e-2}) {
    Scene scene = test::slider({.mass = mass, .stiffness = stiffness, .reference = reference});
    scene.options.time_step = h;
    scene.q[0] = start;
    Simulator sim(std::move(scene));
    // z = (q - q_ref) + i w / omega evolves as exp(-i omega t); a step divides it by 1 + i h omega.
    const double omega = std::sqrt(stiffness / mass);
    const std::complex<double> factor = 1.0 / std::complex<double>(1.0, h * omega);
    std::complex<double> z(start - reference, 0.0);
    for (int i = 0; i < 500; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      z *= factor;
      ASSERT_NEAR(sim.state().q[0], reference + z.real(), kRoundoff) << i;
      ASSERT_NEAR(sim.state().v[0], omega * z.imag(), kRoundoff * omega) << i;
    }
  }
}

TEST(Springs, TakeEnergyInEveryStepWhateverTheirStiffness) {
  for (const double stiffness : {1e-3, 1.0, 1e6, 1e12}) {
    Scene scene = test::slider({.mass = 2.0, .stiffness = stiffness});
    scene.options.time_step = 0.01;
    scene.v[0] = 1.0;
    Simulator sim(std::move(scene));
    const auto energy = [&] {
      return sim.state().v[0] * sim.state().v[0] + spring_energy(sim.model(), sim.state().q);
    };
    double last = energy();
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      // E+ = E / (1 + h^2 omega^2), up to rounding.
      ASSERT_NEAR(energy(), last / (1.0 + 1e-4 * stiffness / 2.0), kRoundoff * last)
          << stiffness << " step " << i;
      last = energy();
    }
  }
}

TEST(Springs, HangOutTheLoadTheyCarry) {
  const double stiffness = 40.0, force = 6.0;
  Simulator sim(test::slider({.mass = 1.0, .stiffness = stiffness, .damping = 10.0}));
  sim.input().applied_force[0] = force;
  for (int i = 0; i < 10000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().q[0], force / stiffness, kRoundoff);
}

TEST(Springs, SwitchedOffTheyAreNotThere) {
  Scene scene = test::slider({.mass = 2.0, .stiffness = 50.0});
  scene.options.effects.set(Effect::kSprings, false);
  scene.q[0] = 1.0;
  scene.v[0] = 0.5;
  Simulator sim(std::move(scene));
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_EQ(sim.state().v[0], 0.5);
  EXPECT_EQ(sim.effect_counts()[Effect::kSprings], 0);
}

}  // namespace
}  // namespace counterpoint::springs_test
