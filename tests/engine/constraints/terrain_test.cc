// Bodies on terrain made of triangles move as on the plane and do not fall through hills.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"
#include "support/record_largest.h"
#include "support/shape_reference.h"

namespace counterpoint::test::terrain_test {
namespace {

// Terrain: x from -1 to 13 m, y from -2 to 2 m in cells of 0.23 m with randomly moved corners; z =
// height(x, y).
template <typename Height>
Shape ground(const Height& height) {
  constexpr double kPitch = 0.23;
  constexpr int kColumns = 61, kRows = 18;
  Random random(3);
  TriangleMesh mesh;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      const double x = -1.0 + kPitch * j + random.uniform(-0.05, 0.05);
      const double y = -2.0 + kPitch * i + random.uniform(-0.05, 0.05);
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int i = 0; i + 1 < kRows; ++i) {
    for (int j = 0; j + 1 < kColumns; ++j) {
      const int k = i * kColumns + j;
      mesh.triangles.push_back({k, k + 1, k + kColumns + 1});
      mesh.triangles.push_back({k, k + kColumns + 1, k + kColumns});
    }
  }
  Shape shape;
  shape.type = ShapeType::kTerrain;
  shape.terrain = make_terrain(mesh);
  return shape;
}

const auto kFlat = [](double, double) { return 0.0; };
const auto kHills = [](double x, double y) {
  return 0.15 * std::sin(3.0 * x) * std::cos(2.5 * y) - 0.1 * x;
};

Scene scene_on(const Shape& ground, const Shape& body) {
  Material material;
  material.friction = 0.6;
  ModelBuilder builder;
  builder.add_environment("ground", ground, Pose{}, material);
  RobotSpec robot;
  robot.name = "body";
  LinkSpec link;
  link.name = "body";
  link.inertia = solid_inertia(body, 1.0);
  link.collisions.push_back({"", Pose{}, body, material});
  robot.links.push_back(link);
  builder.add_robot(robot, Base::kFloating, Pose{});
  Model model = builder.build();
  VectorX q = model.default_q();
  VectorX v = VectorX::Zero(model.nv());
  return {"terrain", std::move(model), std::move(q), std::move(v), {}};
}

struct Rolling {
  const char* name;
  Shape shape;
  double height;       // height of the centre [m]
  bool lying;          // axis along y
  double speed, spin;  // [m/s], about y [rad/s]
};

class Flat : public ::testing::TestWithParam<Rolling> {};

INSTANTIATE_TEST_SUITE_P(
    Terrain, Flat,
    ::testing::Values(Rolling{"capsule", capsule_shape(0.1, 0.3), 0.1, true, 2.0, 20.0},
                      Rolling{"sphere", sphere_shape(0.15), 0.15, false, 2.0, 2.0 / 0.15},
                      Rolling{"cylinder", cylinder_shape(0.1, 0.3), 0.1, true, 2.0, 20.0},
                      Rolling{"box", box_shape({0.3, 0.2, 0.1}), 0.1, false, 9.0, 0.0}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_P(Flat, TenMetresAsOnAPlane) {
  const Rolling& r = GetParam();
  const auto start = [&](const Shape& below) {
    Scene scene = scene_on(below, r.shape);
    scene.q[2] = r.height;
    const double half = std::sqrt(0.5);
    if (r.lying) scene.q.segment<4>(3) << half, half, 0.0, 0.0;
    scene.v[0] = r.speed;
    // Angular velocity is in body axes: after 90 degrees about x, the world's y is the body's -z.
    if (r.lying) {
      scene.v[5] = -r.spin;
    } else {
      scene.v[4] = r.spin;
    }
    scene.options.contact.friction_model = FrictionModel::kCoulomb;
    return scene;
  };
  Simulator on_plane(start(plane_shape()));
  Simulator on_ground(start(ground(kFlat)));
  RecordLargest deviation("deviation_m");
  for (int i = 0; i < 2500; ++i) {
    ASSERT_TRUE(on_plane.step().succeeded());
    ASSERT_TRUE(on_ground.step().succeeded()) << "step " << i;
    // The requirement is 1 mm. The same points in another order differ by round-off and by the
    // solver's tolerance of 1e-10 a step over 2500 steps.
    EXPECT_LT(deviation((on_ground.state().q - on_plane.state().q).head<3>().norm()), 1e-6);
  }
  EXPECT_GT(on_ground.state().q[0], r.spin > 0.0 ? 9.9 : 6.5);
  EXPECT_LT(std::abs(on_ground.state().q[1]), 1e-6);
}

// A height field of equal cells gives no jolt at any seam.
TEST(Terrain, ACapsuleRollsTenMetresOnAHeightField) {
  HeightGrid grid{41, 121, std::vector<double>(41 * 121, 0.7)};
  Shape field;
  field.type = ShapeType::kTerrain;
  field.terrain = make_terrain(height_field_mesh(grid, 28.0, 4.0, 1.0, "flat"));
  Scene scene = scene_on(field, capsule_shape(0.1, 0.3));
  const double half = std::sqrt(0.5);
  scene.q << 0.0, 0.0, 0.8, half, half, 0.0, 0.0;
  scene.v << 2.0, 0.0, 0.0, 0.0, 0.0, -20.0;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 2500; ++i) {
    ASSERT_TRUE(sim.step().succeeded()) << "step " << i;
    ASSERT_NEAR(sim.state().v[0], 2.0, 1e-6) << "step " << i;  // compliance and round-off, as above
  }
  EXPECT_NEAR(sim.state().q[0], 10.0, 1e-5);
  EXPECT_NEAR(sim.state().q[1], 0.0, 1e-6);
  EXPECT_NEAR(sim.state().q[2], 0.8, 1e-6);
}

// Throws a body at hills in a random orientation. True if its centre never gets more than `depth`
// [m] below them.
bool stays_above(const Shape& hills, const Shape& body, double speed, Random& random,
                 double depth = 0.0) {
  Scene scene = scene_on(hills, body);
  const Quaternion turn = random.quaternion();
  scene.q.head<3>() = Vector3(random.uniform(4, 8), random.uniform(-1, 1), 0.5);
  scene.q.segment<4>(3) << turn.w(), turn.x(), turn.y(), turn.z();
  scene.v.head<3>() = speed * Vector3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), -1);
  scene.v.tail<3>() = 5.0 * random.unit_vector();
  Simulator sim(std::move(scene));
  for (int i = 0; i < 400; ++i) {
    const StepReport report = sim.step();
    // A plate that turns by more than a radian a step diverges by the integrator, not by contact.
    if (report.status == contact::Status::kDiverged) return true;
    EXPECT_TRUE(report.succeeded()) << "step " << i;
    const Vector3 p = sim.state().q.head<3>();
    if (p.x() < -0.5 || p.x() > 12.0 || std::abs(p.y()) > 1.5) return true;  // off the ground
    const auto below = collision::cast_ray(hills, Pose{}, {p.x(), p.y(), 1.0}, -Vector3::UnitZ());
    EXPECT_TRUE(below);
    if (!below || p.z() <= below->position.z() - depth) return false;
  }
  return true;
}

TEST(Terrain, NothingFallsThroughHills) {
  const Shape hills = ground(kHills);
  Random random(9);
  for (const Shape& body :
       {sphere_shape(0.05), capsule_shape(0.02, 0.2), cylinder_shape(0.1, 0.02)}) {
    for (const double speed : {0.0, 10.0, 300.0}) {
      for (int run = 0; run < 8; ++run)
        EXPECT_TRUE(stays_above(hills, body, speed, random))
            << "speed " << speed << ", run " << run;
    }
  }
}

// A plate of 0.2 x 0.1 x 0.004 m that slaps down turns by 0.3 rad within a step: its corners go
// centimetres into the ground, and a ridge below goes into the plate. Where its centre is more than
// half its thickness below a ridge, the ridge comes out at the top and the plate has fallen
// through. Measured: 3 of 5400 throws, none of these 300. Two would be ten times that rate.
TEST(Terrain, ThinPlatesHardlyEverFallThroughHills) {
  constexpr double kHalf = 0.002;
  const Shape hills = ground(kHills);
  Random random(9);
  int lost = 0;
  for (const double speed : {0.0, 3.0, 10.0, 30.0, 100.0, 300.0}) {
    for (int run = 0; run < 50; ++run)
      lost += stays_above(hills, box_shape({0.1, 0.05, kHalf}), speed, random, kHalf) ? 0 : 1;
  }
  EXPECT_LE(lost, 1);
  RecordProperty("lost", lost);
}

TEST(Terrain, AStepDoesNotAllocate) {
  if (!counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  Scene scene = scene_on(ground(kFlat), box_shape({0.3, 0.2, 0.1}));
  scene.q[2] = 0.1;
  Simulator sim(std::move(scene));
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(sim.step().succeeded());
  const std::size_t before = allocation_count();
  for (int i = 0; i < 50; ++i) sim.step();
  EXPECT_EQ(allocation_count(), before);
}

TEST(Terrain, TheInverseRecoversTheForceOnHills) {
  const Shape hills = ground(kHills);
  Scene scene = scene_on(hills, box_shape({0.1, 0.15, 0.05}));
  scene.q.head<3>() << 5.0, 0.0, 0.1;
  Simulator sim(std::move(scene));
  Random random(11);
  double error = 0.0, scale = 0.0;
  int contacts = 0;
  for (int i = 0; i < 1000; ++i) {
    sim.input().applied_force << random.vector(5.0), random.vector(0.2);
    const State before = sim.state();
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded()) << "step " << i;
    contacts += report.contacts;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    error = std::max(error, (inverse.applied_force - sim.input().applied_force).norm());
    scale = std::max(scale, inverse.force_scale);
  }
  EXPECT_GT(contacts, 1000);
  EXPECT_LT(error, 1e-8 * scale);  // the bound for all contacts (inverse_test)
}

}  // namespace
}  // namespace counterpoint::test::terrain_test
