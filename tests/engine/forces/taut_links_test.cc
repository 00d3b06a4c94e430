// Light links under tension: no suspended load adds energy, whatever its mass.
#include "counterpoint/engine/forces/taut_links.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "support/linkages.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::taut_links_test {
namespace {

constexpr double kG = 9.81, kLink = 0.1, kLinkMass = 0.1, kTop = 6.0;
constexpr int kLinks = 40;
using Point = std::array<double, 2>;  // x, z

/// A chain of links of kLinkMass along these points; the world holds its first end and, if `held`,
/// its last. A box of `load` [kg] hangs `below` [m] under the point between link `at` and the next;
/// it stands above that point where `below` is negative.
Scene rope(const std::vector<Point>& points, double load, size_t at, double below, bool held) {
  std::string models = fmt::format("gravity: [0, 0, {}]\nmodels:\n", -kG), closures = "closures:\n";
  const auto ball = [&](const std::string& a, const std::string& b, double z_a, double z_b) {
    closures += fmt::format(
        "  - {{type: ball, between: [{}, {}], anchor_a: [0, 0, {:.17g}], anchor_b: [0, 0, "
        "{:.17g}]}}\n",
        a, b, z_a, z_b);
  };
  const size_t links = points.size() - 1;
  for (size_t i = 0; i < links; ++i) {
    const auto [x0, z0] = points[i];
    const auto [x1, z1] = points[i + 1];
    models += fmt::format(
        "  - {{name: l{}, capsule: [0.015, 0.035], mass: {}, position: [{:.17g}, 0, {:.17g}], "
        "rpy: [0, {:.17g}, 0]}}\n",
        i, kLinkMass, 0.5 * (x0 + x1), 0.5 * (z0 + z1), M_PI / 2 - std::atan2(z1 - z0, x1 - x0));
    if (i > 0)
      ball(fmt::format("l{}/body", i - 1), fmt::format("l{}/body", i), kLink / 2, -kLink / 2);
  }
  closures += fmt::format("  - {{type: ball, between: [l0/body, world], anchor_a: [0, 0, {}]}}\n",
                          -kLink / 2);
  if (held)
    closures +=
        fmt::format("  - {{type: ball, between: [l{}/body, world], anchor_a: [0, 0, {}]}}\n",
                    links - 1, kLink / 2);
  models += fmt::format(
      "  - {{name: load, box: [0.2, 0.2, 0.2], mass: {}, position: [{:.17g}, 0, {:.17g}]}}\n", load,
      points[at + 1][0], points[at + 1][1] - below);
  ball(fmt::format("l{}/body", at), "load/body", kLink / 2, below);
  const test::TempFolder folder;
  return load_scene(folder.write("rope.yaml", models + closures + "effects: {contacts: off}\n"));
}

/// Points of a chain at rest between two walls, with a load in its middle. Each link carries half
/// the load's weight and that of the links below it; the horizontal force H is the same for all.
std::vector<Point> hanging(double load, double span) {
  constexpr int kHalf = kLinks / 2;
  const auto slope = [&](double H, int i) { return kG * (0.5 * load + (i + 0.5) * kLinkMass) / H; };
  const auto width = [&](double H) {
    double sum = 0.0;
    for (int i = 0; i < kHalf; ++i) sum += kLink / std::hypot(1.0, slope(H, i));
    return sum;
  };
  double low = 1e-3, high = 1e9;
  for (int i = 0; i < 200; ++i)
    (width(0.5 * (low + high)) < 0.5 * span ? low : high) = 0.5 * (low + high);
  std::vector<Point> points{{-0.5 * span, kTop}};
  for (int k = 0; k < kLinks; ++k) {
    const int i = k < kHalf ? kHalf - 1 - k : k - kHalf;
    const double s = slope(low, i), c = kLink / std::hypot(1.0, s);
    points.push_back({points.back()[0] + c, points.back()[1] + (k < kHalf ? -s : s) * c});
  }
  return points;
}

/// Points of a straight chain at `angle` from the vertical.
std::vector<Point> straight(double angle) {
  std::vector<Point> points;
  for (int i = 0; i <= kLinks; ++i)
    points.push_back({i * kLink * std::sin(angle), kTop - i * kLink * std::cos(angle)});
  return points;
}

/// Points of a chain that hangs in two bights, its middle about half as deep as they are.
std::vector<Point> slack(double span) {
  std::vector<Point> points{{-0.5 * span, kTop}};
  const double c = span / kLinks, s = std::sqrt(kLink * kLink - c * c);
  for (int k = 0; k < kLinks; ++k) {
    const bool falls = k < 13 || (k >= 20 && k < 27);
    points.push_back({points.back()[0] + c, points.back()[1] + (falls ? -s : s)});
  }
  return points;
}

/// The same links as a tree of revolute joints, released at `angle` [rad].
Scene tree(double load, double angle) {
  RobotSpec robot;
  robot.name = "chain";
  robot.links.emplace_back().name = "top";
  const auto add = [&](const std::string& name, const SpatialInertia& inertia, double below) {
    LinkSpec link;
    link.name = name;
    link.inertia = inertia;
    JointSpec joint;
    joint.name = "to_" + name;
    joint.parent = robot.links.back().name;
    joint.child = name;
    joint.axis = Vector3::UnitY();
    joint.X_PJ.translation = Vector3(0, 0, -below);
    robot.links.push_back(link);
    robot.joints.push_back(joint);
  };
  SpatialInertia rod =
      solid_inertia({ShapeType::kCapsule, Vector3(0.015, 0.035, 0), nullptr}, kLinkMass);
  rod.center = Vector3(0, 0, -kLink / 2);
  for (int i = 0; i < kLinks; ++i) add(fmt::format("l{}", i), rod, i == 0 ? 0.0 : kLink);
  SpatialInertia box = solid_inertia({ShapeType::kBox, Vector3::Constant(0.2), nullptr}, load);
  box.center = Vector3(0, 0, -0.4);
  add("load", box, kLink);
  ModelBuilder builder(Vector3(0, 0, -kG));
  builder.add_robot(robot, Base::kFixed, Pose(), "");
  Scene scene{"chain", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.q[0] = angle;
  scene.v = VectorX::Zero(scene.model.nv());
  return scene;
}

struct Setting {
  double load, h;
  Integrator integrator;
};
const std::vector<Setting> kSettings = {{100.0, 0.002, Integrator::kSemiImplicitEuler},
                                        {100.0, 0.005, Integrator::kImplicitMidpoint},
                                        {1e4, 0.002, Integrator::kImplicitMidpoint},
                                        {1e4, 0.005, Integrator::kSemiImplicitEuler}};

Simulator start(Scene scene, const Setting& setting) {
  scene.options.time_step = setting.h;
  scene.options.integrator = setting.integrator;
  return Simulator(std::move(scene));
}

/// Largest gain and loss of energy since the start [J], and largest closure error [m].
struct Range {
  double most = 0.0, least = 0.0, open = 0.0;
};
Range run(Simulator& sim, double seconds) {
  const double start = test::energy(sim).total();
  Range range;
  for (double end = sim.state().time + seconds; sim.state().time < end;) {
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << sim.state().time;
    if (!report.succeeded()) break;
    const double change = test::energy(sim).total() - start;
    range.most = std::max(range.most, change);
    range.least = std::min(range.least, change);
    range.open = std::max(range.open, test::open_by(sim));
  }
  return range;
}

/// Velocities at the ends of steps differ from those at rest by half a step of falling; m (g h)^2
/// [J] bounds the energy of that difference.
double half_step_of_falling(const Setting& s) { return s.load * kG * kG * s.h * s.h; }

TEST(TautLinks, HoldALoadWhereItHangs) {
  for (const Setting& s : kSettings) {
    const std::vector<Point> points = hanging(s.load, 3.7588);
    const double sag = kTop - points[kLinks / 2][1];
    Simulator sim = start(rope(points, s.load, kLinks / 2 - 1, 0.4, true), s);
    const double z = sim.state().q[7 * kLinks + 2];
    const Range range = run(sim, 1.0);
    EXPECT_LT(range.most, half_step_of_falling(s)) << s.load << ' ' << s.h;
    EXPECT_LT(range.open, 1e-4) << s.load << ' ' << s.h;
    EXPECT_NEAR(sim.state().q[7 * kLinks + 2], z, 0.01 * sag) << s.load << ' ' << s.h;
  }
}

/// Share of the energy that a first-order (Euler) step may add for a while; a swing of 4 s may lose
/// twice that.
constexpr double kSwing = 0.01;

TEST(TautLinks, SwingingLoadsGainNothingAndLoseLittle) {
  for (const Setting& s : kSettings) {
    const double angle = 0.5, height = s.load * kG * 4.4 * (1.0 - std::cos(angle));
    for (const bool closures : {true, false}) {
      Scene scene =
          closures ? rope(straight(angle), s.load, kLinks - 1, 0.4, false) : tree(s.load, angle);
      Simulator sim = start(std::move(scene), s);
      const Range range = run(sim, 4.0);
      EXPECT_LT(range.most, kSwing * height) << closures << ' ' << s.load << ' ' << s.h;
      EXPECT_GT(range.least, -2.0 * kSwing * height) << closures << ' ' << s.load << ' ' << s.h;
    }
  }
}

TEST(TautLinks, ALoadDroppedIntoSlackRopesGainsNothing) {
  for (const Setting& s : kSettings) {
    Simulator sim = start(rope(slack(3.0), s.load, kLinks / 2 - 1, -0.3, true), s);
    const Range range = run(sim, 2.0);
    EXPECT_LT(range.most, half_step_of_falling(s)) << s.load << ' ' << s.h;
    EXPECT_LT(range.open, 0.01) << s.load << ' ' << s.h;                 // while it is caught
    EXPECT_LT(range.least, -0.2 * s.load * kG) << s.load << ' ' << s.h;  // it was caught
  }
}

/// A bridge of planks of 0.5 kg and 0.2 m, joined along both edges and to the world at both ends,
/// and a box that falls on its middle.
Scene bridge(double load) {
  constexpr int kPlanks = 20;
  constexpr double kLong = 0.2, kDrop = 0.02;
  std::string models =
                  fmt::format("gravity: [0, 0, {}]\ndefaults: {{friction: 0.6}}\nmodels:\n", -kG),
              closures = "closures:\n";
  std::vector<Point> points{{0.0, 3.0}};
  for (int i = 0; i < kPlanks; ++i) {
    const double a = 0.14 * ((2 * i + 1.0) / kPlanks - 1.0);
    points.push_back(
        {points.back()[0] + kLong * std::cos(a), points.back()[1] + kLong * std::sin(a)});
  }
  for (size_t i = 0; i < kPlanks; ++i) {
    const auto [x0, z0] = points[i];
    const auto [x1, z1] = points[i + 1];
    models += fmt::format(
        "  - {{name: p{}, box: [0.095, 0.3, 0.02], mass: 0.5, position: [{:.17g}, 0, {:.17g}], "
        "rpy: [0, "
        "{:.17g}, 0]}}\n",
        i, 0.5 * (x0 + x1), 0.5 * (z0 + z1), -std::atan2(z1 - z0, x1 - x0));
  }
  const Point middle = points[kPlanks / 2];
  models += fmt::format(
      "  - {{name: load, box: [0.2, 0.2, 0.2], mass: {}, position: [{:.17g}, 0, {:.17g}]}}\n", load,
      middle[0], middle[1] + 0.22 + kDrop);
  for (const double y : {-0.3, 0.3}) {
    for (int i = 1; i < kPlanks; ++i)
      closures += fmt::format(
          "  - {{type: ball, between: [p{}/body, p{}/body], anchor_a: [0.1, {}, 0], anchor_b: "
          "[-0.1, {}, 0]}}\n",
          i - 1, i, y, y);
    closures +=
        fmt::format("  - {{type: ball, between: [p0/body, world], anchor_a: [-0.1, {}, 0]}}\n", y);
    closures += fmt::format(
        "  - {{type: ball, between: [p{}/body, world], anchor_a: [0.1, {}, 0]}}\n", kPlanks - 1, y);
  }
  const test::TempFolder folder;
  return load_scene(folder.write("bridge.yaml", models + closures));
}

TEST(TautLinks, ABridgeCarriesALoadThroughItsContacts) {
  for (const Setting& s : kSettings) {
    Simulator sim = start(bridge(s.load), s);
    const Range range = run(sim, 1.0);
    EXPECT_LT(range.most, half_step_of_falling(s)) << s.load << ' ' << s.h;
    EXPECT_LT(range.open, 2e-3) << s.load << ' ' << s.h;
    // It stands on the planks, which yield by no more than their sag.
    EXPECT_GT(sim.state().q[7 * 20 + 2], 2.9) << s.load << ' ' << s.h;
  }
}

/// Relative to the forces at the closures. A velocity is rounded to 1e-16 |J| |w|, a force to that
/// over r h, with r = 1e-4 kHeaviestHeld over the load.
constexpr double kRecovered = 1e-9;

TEST(TautLinks, TheInverseRecoversWhatWasAppliedToThem) {
  for (const Setting& s : kSettings) {
    Simulator sim = start(rope(straight(0.5), s.load, kLinks - 1, 0.4, false), s);
    test::Random random(7);
    double off = 0.0, scale = 0.0;
    int slowed = 0;
    for (int k = 0; k < 100; ++k) {
      sim.input().applied_force = test::random_vector(sim.model().nv(), random.bits(), 0.2);
      const State before = sim.state();
      const StepReport report = sim.step();
      ASSERT_TRUE(report.succeeded()) << k;
      slowed += report.taut_links;
      find_taut_links(sim.state(), sim.input().taut_links);
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
      sim.input().taut_links.clear();
      off = std::max(off,
                     (inverse.applied_force - sim.input().applied_force).lpNorm<Eigen::Infinity>());
      scale = std::max(scale, inverse.force_scale);
    }
    EXPECT_GT(slowed, 0);
    EXPECT_LT(off, kRecovered * scale) << s.load << ' ' << s.h;
  }
}

/// No law here has a kink, and with closures this stiff rounding is the larger error.
constexpr double kDifferenceStep = 1e-6;

TEST(TautLinks, TheInverseHasExactDerivatives) {
  for (const Setting& s : kSettings) {
    for (const bool closures : {true, false}) {
      std::vector<Point> points = straight(0.5);
      points.resize(4);
      Scene scene = closures ? rope(points, s.load, 2, 0.4, false) : tree(s.load, 0.5);
      Simulator sim = start(std::move(scene), s);
      bool lost = false;
      for (int k = 0; k < 60; ++k) {  // steps with and without loss of energy
        const State before = sim.state();
        ASSERT_TRUE(sim.step().succeeded());
        if (k % 20 != 19) continue;
        test::Moment at{before.q, before.v, sim.state().v, {}, sim.state().q};
        find_taut_links(sim.state(), at.known.taut_links);
        ASSERT_FALSE(at.known.taut_links.empty());
        for (TautLink& link : at.known.taut_links) {
          if (k == 39 && s.integrator == Integrator::kSemiImplicitEuler)
            link.kept = 0.5 * (1.0 + link.factor);
          lost = lost || link.kept < link.factor;
        }
        test::expect_exact(sim.scene(), at,
                           fmt::format("closures {}, {} kg, step {}", closures, s.load, k), true,
                           kDifferenceStep);
      }
      EXPECT_TRUE(lost || s.integrator != Integrator::kSemiImplicitEuler);
    }
  }
}

TEST(TautLinks, AreRecordedWithStatesAndTrajectories) {
  const Setting s{100.0, 0.005, Integrator::kSemiImplicitEuler};
  Simulator sim = start(rope(straight(0.5), s.load, kLinks - 1, 0.4, false), s);
  const test::TempFolder folder;
  const auto file = folder.path() / "t.csv", saved = folder.path() / "s.csv";
  std::vector<std::vector<TautLink>> links;
  {
    TrajectoryWriter writer(file, sim.model());
    for (int k = 0; k < 5; ++k) {
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
      find_taut_links(sim.state(), links.emplace_back());
      writer.write_step(before, Input(), s.h, {}, links.back());
    }
    writer.write_end(sim.state());
  }
  const Trajectory read = read_trajectory(file, sim.model());
  EXPECT_EQ(read.taut_links, links);
  EXPECT_GE(links.front().size(), static_cast<size_t>(kLinks));
  // A run resumed from a state file gives the same bits.
  write_state(saved, sim.model(), sim.options(), sim.state());
  Simulator resumed(sim.scene());
  resumed.set_state(read_state(saved, sim.model(), sim.options(), SceneCheck::kSame));
  for (int k = 0; k < 5; ++k) {
    ASSERT_TRUE(sim.step().succeeded() && resumed.step().succeeded());
    ASSERT_EQ(sim.state().q, resumed.state().q) << k;
    ASSERT_EQ(sim.state().memory, resumed.state().memory) << k;
  }
}

/// Links that carry over a hundred times their weight are examined, but at 0.2 ms none turns too
/// fast.
TEST(TautLinks, WhatStepsFollowAnywayMovesAsWithoutThemToTheBit) {
  Scene scene = rope(straight(0.5), 12.0, kLinks - 1, 0.4, false);
  scene.options.time_step = 2e-4;
  Scene without = scene;
  without.options.effects.set(Effect::kTautLinks, false);
  Simulator sim(std::move(scene)), other(std::move(without));
  for (int k = 0; k < 100; ++k) {
    ASSERT_EQ(sim.step().taut_links, 0);
    ASSERT_TRUE(other.step().succeeded());
    ASSERT_EQ(sim.state().q, other.state().q) << k;
  }
  EXPECT_GT(list_pulled_links(sim.model()).size(), 0u);
}

TEST(TautLinks, StepsAllocateNothing) {
  Simulator sim = start(rope(straight(0.5), 1e4, kLinks - 1, 0.4, false), kSettings[3]);
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(sim.step().succeeded());
  const std::size_t before = test::allocation_count();
  for (int k = 0; k < 20; ++k) ASSERT_GT(sim.step().taut_links, 0);
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(TautLinks, GivenFactorsAreChecked) {
  const Scene scene = tree(100.0, 0.5);
  Workspace workspace(scene.model);
  State next;
  for (const TautLink& wrong :
       {TautLink{0, 2.0, 1.0}, {1, 2.0, 3.0}, {99, 2.0, 1.0}, {1, 2.0, 0.5}}) {
    Input input;
    input.taut_links = {wrong};
    EXPECT_THROW(step_forward(scene.model, scene.options, {}, {0.0, scene.q, scene.v}, input,
                              workspace, next),
                 InputError);
  }
}

}  // namespace
}  // namespace counterpoint::taut_links_test
