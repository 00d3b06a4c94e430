// Surfaces with a stiffness per area: patches press by their overlap, however many points they
// have.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::area_stiffness_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStiffness = 1e6;  ///< [N/m^3]
/// Ratio of damper and spring of the bodies that come to rest [s].
constexpr double kRelaxation = 0.05;
/// Smoothing lifts a body by 1e-13 m for each of up to 8 points, times the ratio of damper and h k.
constexpr double kSmoothing = 8e-13 * kRelaxation / 0.002;

/// Corner of a polygon about the origin [m], in numbers that the single precision of mesh files
/// keeps.
Eigen::Vector2d corner(int i, int corners, double radius) {
  constexpr double kGrid = 1 << 20;
  const double angle = 2.0 * kPi * i / corners;
  return (kGrid * radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))).array().round() /
         kGrid;
}

double polygon_area(int corners, double radius) {
  double twice = 0.0;
  for (int i = 0; i < corners; ++i) {
    const Eigen::Vector2d p = corner(i, corners, radius), q = corner(i + 1, corners, radius);
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * twice;
}

/// A prism on end about the z axis through the origin, as OBJ text, of half height `half` [m].
std::string prism(int corners, double radius, double half) {
  std::string text;
  for (const double z : {-half, half})
    for (int i = 0; i < corners; ++i) {
      const Eigen::Vector2d p = corner(i, corners, radius);
      text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", p.x(), p.y(), z);
    }
  for (int i = 2; i < corners; ++i)
    text +=
        fmt::format("f 1 {} {}\nf {} {} {}\n", i + 1, i, corners + 1, corners + i, corners + i + 1);
  for (int i = 0; i < corners; ++i) {
    const int j = (i + 1) % corners;
    text += fmt::format("f {} {} {}\nf {} {} {}\n", i + 1, j + 1, corners + j + 1, i + 1,
                        corners + j + 1, corners + i + 1);
  }
  return text;
}

/// One free body on ground, both smooth. `shape`: its shape; k_A: of its surface [N/m^3].
Scene on_ground(const std::string& shape, double mass, double height, double k = kStiffness,
                const std::string& integrator = "semi_implicit_euler") {
  const test::TempFolder folder;
  folder.write("prism.obj", prism(24, 0.2, 0.0625));
  return load_scene(
      folder.write("scene.yaml", fmt::format(R"(
time_step: 0.002
integrator: {}
ground: {{friction: 0}}
models:
  - {{name: body, {}, mass: {}, position: [0, 0, {}], friction: 0, stiffness_per_area: {},
     damping_per_area: {}}}
)",
                                             integrator, shape, mass, height, k, kRelaxation * k)));
}

/// Lets a body come to rest; returns by how much it is below `height` [m].
double depth_at_rest(const Scene& scene, double height) {
  Simulator sim(scene);
  while (sim.state().time < 4.0) EXPECT_TRUE(sim.step().succeeded());
  return height - sim.state().q[2];
}

// A load F presses a patch of area A by F / (k_A A), on four points or on eight.
TEST(AreaStiffness, FacesYieldByTheLoadOverStiffnessAndArea) {
  const double polygon = polygon_area(24, 0.2);
  const struct {
    const char* shape;
    double area, half;
  } bodies[] = {{"box: [0.2, 0.15, 0.05]", 0.12, 0.05},
                {"cylinder: [0.2, 0.2]", kPi * 0.04, 0.1},
                {"mesh: prism.obj", polygon, 0.0625}};
  for (const auto& body : bodies) {
    for (const char* integrator : {"semi_implicit_euler", "implicit_midpoint"}) {
      const double depth = kStandardGravity * 300.0 / (kStiffness * body.area);
      const Scene scene =
          on_ground(body.shape, 300.0, body.half - 0.9 * depth, kStiffness, integrator);
      EXPECT_NEAR(depth_at_rest(scene, body.half), depth, 1e-9 * depth + kSmoothing)
          << body.shape << integrator;
    }
  }
}

// Both surfaces yield: their springs per area are in series, and so are those of a point with its
// share of the area.
TEST(AreaStiffness, SurfacesAreInSeries) {
  const Material a{.per_area = {2e6, 8.0, 0.9}}, b{.per_area = {6e6, 16.0, 0.0}};
  const Material both = combine_materials(a, b);
  EXPECT_DOUBLE_EQ(both.per_area.stiffness, 1.5e6);
  EXPECT_DOUBLE_EQ(both.per_area.damping, 8.0 * 9.0 / 16.0 + 16.0 / 16.0);
  EXPECT_DOUBLE_EQ(both.per_area.dissipation, 0.9 * 9.0 / 16.0);
  EXPECT_DOUBLE_EQ(both.spring_of(0.01).stiffness, 1.5e4);
  EXPECT_DOUBLE_EQ(both.spring_of(0.01).damping, 0.055);
  const Material point{.stiffness = 1e4};
  EXPECT_DOUBLE_EQ(combine_materials(point, a).spring_of(0.015).stiffness, 0.75e4);
  EXPECT_DOUBLE_EQ(a.spring_of(0.0).stiffness, 2e6 * kLeastPatchArea);
}

// A box on a fixed one that is turned by 45 degrees, so that one corner hangs over: the patch is a
// pentagon. The depth at its centroid is F / (k_A A).
TEST(AreaStiffness, APatchWithACornerOverhangingYieldsAtItsCentroid) {
  constexpr double kLeg = 0.04, kHalf = 0.1, kMass = 2.0, k = 1e8;
  const double area = 4.0 * kHalf * kHalf - 0.5 * kLeg * kLeg;
  // The side of the lower box cuts the corner: x + y = 2 kHalf - kLeg.
  const double away = (2.0 * kHalf - kLeg) / std::sqrt(2.0) - 1.0, lower = away / std::sqrt(2.0);
  const test::TempFolder folder;
  Simulator sim(
      load_scene(folder.write("scene.yaml", fmt::format(R"(
time_step: 0.002
environment:
  - {{name: table, box: [1, 1, 0.5], position: [{}, {}, -0.5], rpy: [0, 0, {}], friction: 0.5}}
models:
  - {{name: box, box: [0.1, 0.1, 0.05], mass: {}, position: [0, 0, 0.05], friction: 0.5,
     stiffness_per_area: {}, damping_per_area: 1.0e+5}}
)",
                                                        lower, lower, kPi / 4, kMass, k))));
  while (sim.state().time < 4.0) ASSERT_TRUE(sim.step().succeeded());
  const double off = -0.5 * kLeg * kLeg * (kHalf - kLeg / 3.0) / area;  // centroid along x and y
  const VectorX& q = sim.state().q;
  const Pose X{Quaternion(q[3], q[4], q[5], q[6]).toRotationMatrix(), q.head<3>()};
  const double depth = kMass * kStandardGravity / (k * area);
  // Tilted by 1e-5 rad, the pentagon is off by 1e-10 of its size, and the centre of mass moves by
  // 5e-7 m.
  EXPECT_NEAR(-(X * Vector3(off, off, -0.05)).z(), depth, 1e-9 * depth + kSmoothing);
}

// ---- Where the points press.

/// Force [N] and moment about the world's x and y axes [N m] of all springs at the points.
struct Pressure {
  double force = 0.0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
};

/// Presses a shape at a pose on soft ground z = 0.
Pressure press(const std::string& shape, const Pose& X) {
  const Scene scene = on_ground(shape, 1.0, 0.0);
  collision::SceneQuery query(scene.model);
  query.set_poses(std::vector<Pose>{Pose(), X});
  Pressure out;
  for (const collision::Candidate& c : query.contacts()) {
    EXPECT_LE(c.gap, 0.0);
    EXPECT_GE(c.area, 0.0);
    const double force = -kStiffness * c.area * c.gap;
    out.force += force;
    out.moment += force * Eigen::Vector2d(c.position.y(), -c.position.x());
  }
  return out;
}

std::string box(const Vector3& half) {
  return fmt::format("box: [{}, {}, {}]", half.x(), half.y(), half.z());
}

Pose lowered(const Matrix3& rotation, const Vector3& half, double depth) {
  const double low = rotation.row(2).cwiseAbs().dot(half);
  return {rotation, Vector3(0.0, 0.0, low - depth)};
}

Matrix3 turn(double angle, const Vector3& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

// A face that overlaps evenly resists tilting with k_A I, I its second moment of area about the
// axis of the tilt, about any axis.
TEST(AreaStiffness, AFaceResistsTiltingByItsSecondMomentOfArea) {
  constexpr double kTilt = 1e-5, kDepth = 0.01;
  for (const Vector3& half : {Vector3(0.1, 0.1, 0.05), Vector3(0.04, 0.2, 0.05)}) {
    for (const double yaw : {0.0, 0.3, 1.1}) {
      const double area = 4.0 * half.x() * half.y(), c = std::cos(yaw), s = std::sin(yaw);
      const double about_x = area / 3.0 * (std::pow(half.y() * c, 2) + std::pow(half.x() * s, 2));
      // The box turns about the x axis through the middle of its lower face.
      const Matrix3 tilt = turn(kTilt, Vector3::UnitX());
      const Vector3 middle(0.0, 0.0, -kDepth);
      const Pose X(tilt * turn(yaw, Vector3::UnitZ()), middle + tilt * Vector3(0, 0, half.z()));
      const Pressure now = press(box(half), X);
      // Sides overlap and the depth changes by the square of the tilt.
      constexpr double kSquare = 10.0 * kTilt;
      EXPECT_NEAR(now.force, kStiffness * area * kDepth, kSquare * now.force);
      EXPECT_NEAR(now.moment.x(), -kStiffness * about_x * kTilt,
                  kSquare * kStiffness * about_x * kTilt);
    }
  }
}

// A torque T tilts a box of the weight W by T / (k_A I - W z), z the height of its centre above its
// lower face.
TEST(AreaStiffness, ATorqueTiltsABoxByTheStiffnessOfItsFace) {
  constexpr double kMass = 50.0, kTorque = 1e-3, kHeight = 0.02;
  for (const double half : {0.1, 0.04}) {
    const double area = 4.0 * half * 0.2, weight = kMass * kStandardGravity;
    const double stiffness = kStiffness * area * half * half / 3.0 - weight * kHeight;
    const double depth = weight / (kStiffness * area);
    Simulator sim(
        on_ground(fmt::format("box: [0.2, {}, {}]", half, kHeight), kMass, kHeight - depth));
    sim.input().wrenches = {{1, {Vector3(kTorque, 0.0, 0.0), Vector3::Zero()}, Vector3::Zero()}};
    while (sim.state().time < 8.0) ASSERT_TRUE(sim.step().succeeded());
    // The sides overlap and the face shrinks by the square of the tilt, below 1e-4 rad.
    constexpr double kSquare = 1e-7;
    const double tilt = 2.0 * sim.state().q[4];
    EXPECT_NEAR(tilt, kTorque / stiffness, kSquare * tilt);
  }
}

// On flat ground the force is the buoyancy in a liquid of the specific weight k_A: it acts in the
// centroid of the part below the ground, whether a face, an edge or a corner is lowest.
TEST(AreaStiffness, ABodyPressesWithItsBuoyancy) {
  constexpr double kHalf = 0.1, kDepth = 0.03, kRoundOff = 1e-12;
  const Vector3 half(kHalf, kHalf, kHalf);
  // An edge at the angle a cuts a triangle of the legs d / cos(a) and d / sin(a).
  for (const double a : {0.3, 0.5, kPi / 4, 1.2}) {
    const Matrix3 tilt = turn(a, Vector3::UnitY());
    const Pose X = lowered(tilt, half, kDepth);
    const Vector3 edge = X * Vector3(kHalf, 0.0, -kHalf);
    const double legs[2] = {kDepth / std::sin(a), kDepth / std::cos(a)};
    const Vector3 centroid = edge + tilt * Vector3(-legs[0] / 3.0, 0.0, legs[1] / 3.0);
    const double force = kStiffness * 0.5 * legs[0] * legs[1] * 2.0 * kHalf;
    const Pressure now = press(box(half), X);
    EXPECT_NEAR(now.force, force, kRoundOff * force) << a;
    EXPECT_NEAR(now.moment.y(), -force * centroid.x(), kRoundOff * force) << a;
  }
  // The diagonal upright: the corner cuts a pyramid of three legs d sqrt(3).
  const Matrix3 upright =
      Eigen::Quaterniond::FromTwoVectors(Vector3(-1, -1, -1), -Vector3::UnitZ()).toRotationMatrix();
  const Pressure now = press(box(half), lowered(upright, half, kDepth));
  const double force = kStiffness * std::pow(std::sqrt(3.0) * kDepth, 3) / 6.0;
  EXPECT_NEAR(now.force, force, 1e-9 * force);
  EXPECT_LT(now.moment.norm(), 1e-9 * force * kHalf);
}

// All faces of a mesh press that are below the ground: a prism of 24 sides on its side.
TEST(AreaStiffness, AMeshPressesWithAllItsFaces) {
  constexpr double kRadius = 0.2, kDepth = 0.03, kHalf = 0.0625, kSingle = 1e-6;
  double below = 0.0;
  for (int i = 0; i < 24; ++i) {
    const Eigen::Vector2d p = corner(i, 24, kRadius), q = corner(i + 1, 24, kRadius);
    const double dp = p.x() - (kRadius - kDepth), dq = q.x() - (kRadius - kDepth);
    if (dp <= 0.0 && dq <= 0.0) continue;
    const double part = dp > 0.0 && dq > 0.0 ? 1.0 : std::max(dp, dq) / std::abs(dp - dq);
    below += 0.5 * (std::max(dp, 0.0) + std::max(dq, 0.0)) * part * std::abs(q.y() - p.y());
  }
  const Pose X(turn(kPi / 2, Vector3::UnitY()), Vector3(0.0, 0.0, kRadius - kDepth));
  const Pressure now = press("mesh: prism.obj", X);
  const double force = kStiffness * below * 2.0 * kHalf;
  EXPECT_NEAR(now.force, force, kSingle * force);  // meshes are in single precision
  EXPECT_LT(now.moment.norm(), kSingle * force * kRadius);
}

// A tyre's load curve: a cylinder of radius R and length L on its side carries k_A L 4/3 d sqrt(2 R
// d), and a ball k_A pi R d^2 (overlaps small beside R).
TEST(AreaStiffness, RoundShapesCarryTheVolumeOfTheirOverlap) {
  constexpr double kRadius = 0.3, kLength = 0.2;
  for (const double depth : {0.002, 0.01, 0.03}) {
    const double k = 4e6;
    const double line = k * kLength * 4.0 / 3.0 * depth * std::sqrt(2.0 * kRadius * depth);
    const Scene wheel = on_ground("cylinder: [0.3, 0.2], rpy: [1.5707963267948966, 0, 0]",
                                  line / kStandardGravity, kRadius - 0.8 * depth, k);
    EXPECT_NEAR(depth_at_rest(wheel, kRadius), depth, 1e-9 * depth + kSmoothing);
    const Scene ball =
        on_ground("sphere: 0.3", k * kPi * kRadius * depth * depth / kStandardGravity,
                  kRadius - 0.8 * depth, k);
    EXPECT_NEAR(depth_at_rest(ball, kRadius), depth, 1e-9 * depth + kSmoothing);
  }
}

// Friction acts at the distance R / sqrt(2) from the middle of a disc of the radius R, whose second
// moment is R^2 / 4 about each axis.
TEST(AreaStiffness, ADiscIsBrakedByFrictionAtItsPoints) {
  constexpr double kRadius = 0.2, kMass = 5.0, kFriction = 0.5, kSpin = 20.0, kTime = 0.2;
  const double depth = kMass * kStandardGravity / (kStiffness * kPi * kRadius * kRadius);
  const test::TempFolder folder;
  Simulator sim(
      load_scene(folder.write("scene.yaml", fmt::format(R"(
time_step: 0.002
ground: {{friction: {}}}
models:
  - {{name: disc, cylinder: [{}, 0.1], mass: {}, position: [0, 0, {}], friction: {},
     stiffness_per_area: {}, damping_per_area: 1.0e+5, velocity: {{angular: [0, 0, {}]}}}}
)",
                                                        kFriction, kRadius, kMass, 0.05 - depth,
                                                        kFriction, kStiffness, kSpin))));
  while (sim.state().time < kTime - 1e-9) ASSERT_TRUE(sim.step().succeeded());
  const double braking =
      kFriction * kStandardGravity * (kRadius / std::sqrt(2.0)) / (0.5 * kRadius * kRadius);
  // The rim of sixteen corners has a second moment that is 1.3e-4 too large at the same area, and a
  // step is a hundredth of the time.
  constexpr double kRim = 2e-3;
  EXPECT_NEAR(kSpin - sim.state().v[5], braking * kTime, kRim * braking * kTime);
}

// A wheel that rolls keeps depth, load and speed: its points stay the lowest of its rim.
TEST(AreaStiffness, ARollingWheelKeepsItsLoad) {
  Simulator sim(load_scene(test::source_dir() + "/data/scenes/tyre.yaml"));
  const State start = sim.state();
  while (sim.state().time < 1.0) ASSERT_TRUE(sim.step().succeeded());
  double load = 0.0;
  for (const auto& contact : sim.last_forces().contacts) load += std::abs(contact.force.z());
  constexpr double kSettled = 1e-6;  // the scene starts at a depth with seven digits
  EXPECT_NEAR(load, 300.0 * kStandardGravity, 300.0 * kStandardGravity * kSettled);
  EXPECT_NEAR(sim.state().q[2], start.q[2], kSettled);
  EXPECT_NEAR(sim.state().v[0], start.v[0], kSettled * start.v[0]);
}

TEST(AreaStiffness, SettingsThatContradictAreRefused) {
  const auto load = [](const std::string& surface) {
    const test::TempFolder folder;
    return load_scene(folder.write(
        "s.yaml", "ground: {" + surface + "}\nmodels: [{name: b, sphere: 1, mass: 1}]"));
  };
  EXPECT_NO_THROW(load("stiffness_per_area: 1.0e+6, damping_per_area: 3, dissipation: 0.5"));
  EXPECT_THROW(load("stiffness_per_area: 1.0e+6, stiffness: 1.0e+4"), InputError);
  EXPECT_THROW(load("stiffness_per_area: 0"), InputError);
  EXPECT_THROW(load("damping_per_area: 3"), InputError);
  EXPECT_THROW(load("stiffness_per_area: 1.0e+6, damping: 3"), InputError);
  EXPECT_THROW(load("stiffness_per_area: 1.0e+6, restitution: 0.5"), InputError);
}

}  // namespace
}  // namespace counterpoint::area_stiffness_test
