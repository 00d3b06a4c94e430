// Contact compliance under load: heavy bodies on light ones, and creep on slopes by smoothing.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "support/small_scenes.h"

namespace counterpoint::loads_test {
namespace {

/// Cubes of 0.2 m stacked on a plane; masses [kg] from the bottom up.
Simulator tower(const std::vector<double>& masses, double time_step,
                ContactPreset preset = ContactPreset::kDefault) {
  ModelBuilder builder(Vector3(0, 0, -9.81));
  const Material surface{.friction = 0.5};
  const Shape cube{ShapeType::kBox, Vector3::Constant(0.1), nullptr};
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), surface);
  for (size_t i = 0; i < masses.size(); ++i) {
    const std::string name = "cube" + std::to_string(i);
    const Pose at{Matrix3::Identity(), Vector3(0, 0, 0.1 + 0.2 * static_cast<double>(i))};
    builder.add_robot(object_of(name, cube, masses[i], surface), Base::kFloating, at, name + "/");
  }
  Scene scene = scene_of(builder.build(), "tower");
  scene.options.time_step = time_step;
  apply_contact_preset(preset, scene.options.contact);
  return Simulator(std::move(scene));
}

struct Load {
  double ratio, h;
  ContactPreset preset;
};

// Penetration depth at each contact: mu^2 eps ratio h^2 g / (4 beta) [m], 12 um at 1e6 and 2 ms.
TEST(HeavyOnLight, SinksByTheMassRatio) {
  for (const auto& [ratio, h, preset] :
       {Load{1e3, 2e-3, ContactPreset::kDefault}, Load{1e6, 2e-3, ContactPreset::kDefault},
        Load{1e5, 1e-2, ContactPreset::kDefault}, Load{1e8, 2e-3, ContactPreset::kHard}}) {
    SCOPED_TRACE(::testing::Message() << ratio << ' ' << h);
    Simulator sim = tower({1.0, ratio}, h, preset);
    const double eps = sim.options().contact.compliance;
    const double most = 1.05 * 0.25 * eps * ratio * h * h * 9.81 / (4 * 0.2);
    for (int i = 0; i < std::lround(2.0 / h); ++i) {
      const VectorX q = sim.state().q, v = sim.state().v;
      ASSERT_TRUE(sim.step().succeeded());
      const Inverse& inverse = sim.inverse(q, v, sim.state().v);
      // The solver's residual is relative to the momentum of all masses.
      const double bound = ratio > 1e6 ? 1e-6 : 1e-8;
      ASSERT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), bound * inverse.force_scale);
    }
    EXPECT_GT(sim.state().q[2], 0.1 - most);
    EXPECT_GT(sim.state().q[9], 0.3 - 2.0 * most);
  }
}

TEST(HeavyOnLight, ATowerOfFourAHundredTimesEach) {
  Simulator sim = tower({1.0, 1e2, 1e4, 1e6}, 2e-3);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
  // Penetration depth of the 1 kg cube's contacts, below and above it, under 1e6 kg; the other
  // contacts add 1 %.
  const double sinks = 0.25 * 1e-6 * 1e6 * 4e-6 * 9.81 / (4 * 0.2);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(sim.state().q[7 * k + 2], 0.1 + 0.2 * k, 2.1 * sinks) << k;
}

TEST(HeavyOnLight, OrdinaryRatiosKeepTheirCompliance) {
  Simulator sim = tower({1.0, 1e4}, 2e-3);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
  const double sinks =
      0.25 * 1e-6 * 1e4 * 4e-6 * 9.81 / (4 * 0.2);  // mu^2 eps h^2 M g / (4 beta m)
  EXPECT_NEAR(0.1 - sim.state().q[2], sinks, 0.02 * sinks);
}

/// Creep [m/s] of a box on a slope by smoothing (docs/explanation/concepts.md). All corners slip at
/// v, and a corner with load n carries the share s n / (1 + s n) of mu n, with s = v mu h / delta.
double creep(double mu, double tangent, double smoothing, double h, double height_over_half) {
  const double g = 9.81 / kStandardGravity, cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
  const double tilt = height_over_half * tangent;
  const double low = 0.25 * g * cosine * (1.0 + tilt), high = 0.25 * g * cosine * (1.0 - tilt);
  const auto held = [&](double s) {
    return 2.0 * (low * s * low / (1.0 + s * low) + high * s * high / (1.0 + s * high));
  };
  const double needed = tangent / mu * 2.0 * (low + high);
  double least = 0.0, most = 1e6;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (least + most);
    (held(middle) < needed ? least : most) = middle;
  }
  return least * smoothing / (h * mu);
}

TEST(Creep, OfSmoothingFollowsFromTheLaw) {
  for (const auto& [mu, tangent] :
       {std::pair(0.5, 0.1), std::pair(0.5, 0.4), std::pair(0.8, 0.3), std::pair(1.0, 0.5)}) {
    for (const double smoothing : {1e-9, 1e-7, 1e-6}) {
      const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
      Scene scene =
          test::box_on_plane({.friction = mu, .gravity = 9.81 * cosine * Vector3(tangent, 0, -1)});
      scene.options.contact.smoothing = smoothing;
      Simulator sim(std::move(scene));
      for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
      const double before = sim.state().q[0];
      for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
      const double expected = creep(mu, tangent, smoothing, 2e-3, 1.0);
      // 1 %: the compliance adds to the creep at 1e-9 m.
      EXPECT_NEAR((sim.state().q[0] - before) / 1.0, expected, 0.01 * expected)
          << mu << ' ' << tangent << ' ' << smoothing;
      // Formula of the documents, with the load shared equally by four corners.
      const double q = tangent / mu,
                   simple = 4.0 * smoothing / (2e-3 * mu * cosine) * q / (1.0 - q);
      EXPECT_NEAR(simple, expected, 0.2 * expected);
    }
  }
}

TEST(PlainPendulum, IsSymplecticEulerToRounding) {
  // One joint has no velocity-dependent force: w+ = w - h g sin(q) / l, q+ = q + h w+, as in any
  // other engine with this scheme (MuJoCo 3.12: equal to 1e-12 after 10 s).
  for (const double speed : {0.0, 1.0}) {
    Simulator sim(test::pendulum({}));
    const double h = sim.options().time_step;
    State state = sim.state();
    double q = 1.0, w = speed;
    state.q[0] = q;
    state.v[0] = w;
    sim.set_state(state);
    for (int i = 0; i < 5000; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      w -= h * 9.81 * std::sin(q);
      q += h * w;
    }
    EXPECT_NEAR(sim.state().q[0], q, 1e-9) << speed;
  }
}

}  // namespace
}  // namespace counterpoint::loads_test
