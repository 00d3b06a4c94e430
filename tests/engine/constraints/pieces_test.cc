// Bodies that are not convex, as convex pieces: no seam is felt, hollows hold what lies in them,
// and the inverse gives the forces.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/mesh/mesh_mass.h"
#include "support/random_model.h"
#include "support/record_largest.h"
#include "support/recover.h"
#include "support/shape_reference.h"
#include "support/shapes/solids.h"

namespace counterpoint::test::pieces_test {
namespace {

constexpr double kG = kStandardGravity;

Shape pieces_of(const TriangleMesh& mesh, double tolerance) {
  const auto hull = convex_mesh_of(mesh, {MeshKind::kPieces, tolerance, 512});
  EXPECT_GT(hull->pieces.size(), 1U);
  EXPECT_LE(hull->union_standoff, tolerance);
  return {ShapeType::kConvexMesh, Vector3::Zero(), hull};
}

/// A free body that fills a mesh with uniform density.
RobotSpec solid(const std::string& name, const TriangleMesh& mesh, const Shape& shape, double mass,
                const Material& material) {
  const MassProperties unit = mass_properties(mesh, MeshInertia::kExact);
  LinkSpec link;
  link.name = name;
  link.inertia = {mass, unit.center, mass / unit.mass * unit.rotational};
  link.collisions.push_back({"", Pose(), shape, material});
  RobotSpec robot;
  robot.name = name;
  robot.links.push_back(link);
  return robot;
}

Pose at(double x, double y, double z) { return {Matrix3::Identity(), Vector3(x, y, z)}; }

Material rough(double friction) {
  Material material;
  material.friction = friction;
  return material;
}

/// Sum over the contacts of a body of the world's force on it [N].
Vector3 contact_force_on(Simulator& sim, int body) {
  Vector3 sum = Vector3::Zero();
  const auto& geometries = sim.model().geometries();
  for (const auto& contact : sim.last_forces().contacts) {
    if (geometries[contact.contact.geometry_b].body == body) sum += contact.force;
    if (geometries[contact.contact.geometry_a].body == body) sum -= contact.force;
  }
  return sum;
}

/// A flat slab from x = -1 to 13 m with its top at z = 0, as one box or cut at every metre.
Shape slab(bool cut) {
  const auto box = [](double low, double high) {
    std::vector<Vector3> corners;
    for (const double x : {low, high})
      for (const double y : {-2.0, 2.0})
        for (const double z : {-0.5, 0.0}) corners.emplace_back(x, y, z);
    return make_convex_hull(corners);
  };
  ConvexMesh whole = *box(-1.0, 13.0);
  for (int i = -1; cut && i < 13; ++i) whole.pieces.push_back(box(i, i + 1));
  return {ShapeType::kConvexMesh, Vector3::Zero(),
          std::make_shared<const ConvexMesh>(std::move(whole))};
}

// The pieces of a slab touch as the slab: a body that slides or rolls over the seams moves as on
// one box.
TEST(PiecesOfABody, SeamsAreNotFelt) {
  // Round-off of the contact points, grown over 1000 steps of 2 ms.
  constexpr double kSame = 1e-7;  // [m]
  struct Case {
    Shape shape;
    double height, speed, spin;
  };
  for (const Case& c : {Case{sphere_shape(0.15), 0.15, 2.0, 2.0 / 0.15},
                        Case{box_shape({0.3, 0.2, 0.1}), 0.1, 6.0, 0.0},
                        Case{sphere_shape(0.05), 0.05, 4.0, 0.0}}) {
    const auto start = [&](bool cut) {
      ModelBuilder builder;
      builder.add_environment("slab", slab(cut), Pose(), rough(0.5));
      builder.add_robot(object_of("body", c.shape, 1.0, rough(0.5)), Base::kFloating,
                        at(0.1, 0, c.height));
      Scene scene = scene_of(builder.build());
      scene.v[0] = c.speed;
      scene.v[4] = c.spin;
      return scene;
    };
    Simulator one(start(false)), many(start(true));
    double apart = 0.0;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(one.step().succeeded());
      ASSERT_TRUE(many.step().succeeded());
      apart = std::max(apart, (one.state().q - many.state().q).head<3>().norm());
    }
    RecordLargest("apart_m")(apart);
    EXPECT_LT(apart, kSame);
  }
}

// A ball that slides without friction in a bowl of radius R swings as a pendulum of length R - r.
TEST(PiecesOfABody, ABallSwingsInABowlWithThePeriodOfAPendulum) {
  constexpr double kRadius = 0.4, kBall = 0.05, kAngle = 0.2;
  // The facets are 0.1 rad wide, half the amplitude; the period of a swing of 0.2 rad itself is
  // 0.25 % longer than that of a small one.
  constexpr double kFacets = 0.05;
  const Shape inside = pieces_of(bowl(kRadius, 0.05, 0.45, 6, 48), 1e-3);
  ModelBuilder builder;
  builder.add_environment("bowl", inside, Pose(), rough(0.0));
  builder.add_robot(
      object_of("ball", sphere_shape(kBall), 0.3, rough(0.0)), Base::kFloating,
      at((kRadius - kBall) * std::sin(kAngle), 0, -(kRadius - kBall) * std::cos(kAngle)));
  Simulator sim(scene_of(builder.build()));
  std::vector<double> crossings;
  double last = sim.state().q[0], time = 0.0;
  while (time < 3.0) {
    ASSERT_TRUE(sim.step().succeeded());
    const double x = sim.state().q[0], now = sim.state().time;
    if (last > 0.0 && x <= 0.0) crossings.push_back(time + (now - time) * last / (last - x));
    last = x;
    time = now;
    EXPECT_LT(sim.state().q[2], -0.3);  // it stays inside
  }
  ASSERT_GE(crossings.size(), 2U);
  const double period = crossings[1] - crossings[0];
  const double expected = 2.0 * kPi * std::sqrt((kRadius - kBall) / kG);
  RecordLargest("relative_error")(std::abs(period / expected - 1.0));
  EXPECT_NEAR(period / expected, 1.0, kFacets);
}

// A ball dropped into a free cup rests on its bottom; the ground carries both.
TEST(PiecesOfABody, ABallRestsInACup) {
  constexpr double kBall = 0.02, kWall = 0.005, kTolerance = 1e-3;
  const TriangleMesh mesh = cup(0.05, 0.1, kWall, 32);
  ModelBuilder builder;
  builder.add_environment("ground", plane_shape(), Pose(), rough(0.5));
  builder.add_robot(solid("cup", mesh, pieces_of(mesh, kTolerance), 0.2, rough(0.5)),
                    Base::kFloating, at(0, 0, 0.01), "cup/");
  builder.add_robot(object_of("ball", sphere_shape(kBall), 0.1, rough(0.5)), Base::kFloating,
                    at(0.015, 0.005, 0.15), "ball/");
  Scene scene = scene_of(builder.build());
  scene.options.time_step = 0.002;
  Simulator sim(scene);
  Random random(1);
  const double error = recover(sim, 1500, 0.0, random);
  RecordLargest("recovered")(error);
  EXPECT_LT(error, 1e-8);
  const VectorX& q = sim.state().q;
  EXPECT_NEAR(q[9], kWall + kBall, 1e-4);  // the bottom is exact: compliance only
  EXPECT_LT(std::hypot(q[7] - q[0], q[8] - q[1]), 0.05);
  EXPECT_NEAR(contact_force_on(sim, 2).z(), 0.1 * kG, 1e-3 * kG);
  EXPECT_NEAR(contact_force_on(sim, 1).z(), 0.2 * kG, 1e-3 * kG);
}

// Links of a chain hang from each other: each carries the weight below.
TEST(PiecesOfABody, EachLinkOfAChainCarriesWhatIsBelow) {
  constexpr int kLinks = 20;
  constexpr double kRadius = 0.03, kTube = 0.006, kMass = 0.05;
  const TriangleMesh mesh = torus(kRadius, kTube, 24, 12);
  const Shape shape = pieces_of(mesh, 1e-3);
  ModelBuilder builder;
  const auto place = [&](int i) {  // standing, every second one turned by 90 degrees
    const Matrix3 upright = rotation_from_rpy(0.5 * kPi, 0.0, i % 2 == 0 ? 0.0 : 0.5 * kPi);
    return Pose{upright, Vector3(0, 0, -2.0 * i * (kRadius - kTube))};
  };
  builder.add_environment("hook", shape, place(0), rough(0.3));
  for (int i = 1; i <= kLinks; ++i)
    builder.add_robot(solid("link", mesh, shape, kMass, rough(0.3)), Base::kFloating, place(i),
                      "l" + std::to_string(i) + "/");
  Scene scene = scene_of(builder.build());
  scene.options.time_step = 0.002;
  Simulator sim(scene);
  for (int i = 0; i < 1500; ++i) ASSERT_TRUE(sim.step().succeeded()) << i;
  // Up to four pairs of pieces touch at each point; a few steps are softened, and their inverse is
  // that of the softer laws.
  double error = 0.0;
  for (int i = 0; i < 100; ++i) {
    const State before = sim.state();
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded());
    sim.input().softening = report.softening;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    sim.input().softening = {};
    error = std::max(error, inverse.applied_force.cwiseAbs().maxCoeff() / inverse.force_scale);
  }
  RecordLargest("recovered")(error);
  EXPECT_LT(error, 1e-8);
  const auto& geometries = sim.model().geometries();
  for (int i = 1; i <= kLinks; ++i) {
    double carried = 0.0;  // force of link i - 1 [N]
    for (const auto& contact : sim.last_forces().contacts)
      if (geometries[contact.contact.geometry_a].body == i - 1 &&
          geometries[contact.contact.geometry_b].body == i)
        carried += contact.force.z();
    const double below = (kLinks + 1 - i) * kMass * kG;
    // The chain still swings a little after 3 s.
    EXPECT_NEAR(carried / below, 1.0, 0.05) << i;
  }
}

// A ring dropped over a peg lies around it on the ground.
TEST(PiecesOfABody, ARingThrownOnAPegStaysThere) {
  const TriangleMesh mesh = torus(0.08, 0.015, 32, 12);
  ModelBuilder builder;
  builder.add_environment("ground", plane_shape(), Pose(), rough(0.5));
  builder.add_environment("peg", cylinder_shape(0.02, 0.2), at(0, 0, 0.1), rough(0.5));
  builder.add_robot(solid("ring", mesh, pieces_of(mesh, 1e-3), 0.3, rough(0.5)), Base::kFloating,
                    {rotation_from_rpy(0.4, 0.2, 0.0), Vector3(-0.03, 0.01, 0.28)});
  Scene scene = scene_of(builder.build());
  scene.v[0] = 0.2;
  Simulator sim(scene);
  while (sim.state().time < 2.0) ASSERT_TRUE(sim.step().succeeded());
  const VectorX& q = sim.state().q;
  EXPECT_LT(std::hypot(q[0], q[1]), 0.08 - 0.015);  // the peg is within the ring
  EXPECT_NEAR(q[2], 0.015, 1e-3);
  EXPECT_NEAR(contact_force_on(sim, 1).z(), 0.3 * kG, 0.01 * kG);
}

}  // namespace
}  // namespace counterpoint::test::pieces_test
