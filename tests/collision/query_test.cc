// Queries of distance, rays, overlaps and contacts: known answers, and rays against membership
// tests.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/model_builder.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::query_test {
namespace {

using collision::cast_ray;
using collision::Distance;
using collision::SceneQuery;

// Round-off of coordinates of order 1 through a rotation and back.
constexpr double kRoundOff = 1e-13;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Pose at(double x, double y, double z) { return {Matrix3::Identity(), Vector3(x, y, z)}; }

TEST(Distance, KnownAnswers) {
  const auto d =
      collision::distance(sphere_shape(0.5), at(0, 0, 0), box_shape({1, 1, 1}), at(3, 0, 0));
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->gap, 1.5, kRoundOff);
  EXPECT_NEAR((d->normal - Vector3(1, 0, 0)).norm(), 0.0, kRoundOff);
  EXPECT_NEAR((d->point_a - Vector3(0.5, 0, 0)).norm(), 0.0, kRoundOff);
  EXPECT_NEAR((d->point_b - Vector3(2.0, 0, 0)).norm(), 0.0, kRoundOff);
  // Overlap: the normal leads out through the nearest face.
  const auto deep =
      collision::distance(sphere_shape(0.5), at(0, 0, 0.9), box_shape({1, 1, 1}), Pose{});
  ASSERT_TRUE(deep);
  EXPECT_NEAR(deep->gap, -0.6, kRoundOff);
  EXPECT_NEAR((deep->normal - Vector3(0, 0, -1)).norm(), 0.0, kRoundOff);
  EXPECT_NEAR((deep->point_a - Vector3(0, 0, 0.4)).norm(), 0.0, kRoundOff);
  EXPECT_NEAR((deep->point_b - Vector3(0, 0, 1.0)).norm(), 0.0, kRoundOff);
  // At a distance of 1 km.
  const auto far =
      collision::distance(plane_shape(), Pose{}, capsule_shape(0.1, 0.2), at(0, 0, 1000.3));
  ASSERT_TRUE(far);
  EXPECT_NEAR(far->gap, 1000.0, 1e-12 * 1000.0);
}

TEST(Distance, NothingForTwoPlanesOrPosesThatAreNotFinite) {
  EXPECT_FALSE(collision::distance(plane_shape(), Pose{}, plane_shape(), at(0, 0, 1)));
  EXPECT_FALSE(collision::distance(sphere_shape(1), Pose{}, sphere_shape(1), at(kInfinity, 0, 0)));
  EXPECT_FALSE(collision::distance(sphere_shape(1), Pose{}, box_shape({1, 1, 1}), at(0, NAN, 0)));
}

TEST(Overlap, SharingMoreThanTheSurface) {
  const Shape cube = box_shape({0.5, 0.5, 0.5});
  EXPECT_TRUE(collision::overlap(cube, Pose{}, cube, at(0.999, 0, 0)));
  EXPECT_FALSE(collision::overlap(cube, Pose{}, cube, at(1.001, 0, 0)));
  EXPECT_FALSE(collision::overlap(cube, Pose{}, cube, at(0.9, 0.9, 1.1)));
  EXPECT_TRUE(collision::overlap(cube, Pose{}, plane_shape(), at(0, 0, -0.499)));
}

TEST(Ray, KnownAnswers) {
  const auto expect_hit = [](const Shape& shape, const Vector3& origin, const Vector3& direction,
                             double distance, const Vector3& normal) {
    const auto hit = cast_ray(shape, Pose{}, origin, direction);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, distance, kRoundOff);
    EXPECT_NEAR((hit->normal - normal).norm(), 0.0, kRoundOff);
    EXPECT_NEAR((hit->position - origin - distance * direction.normalized()).norm(), 0.0,
                kRoundOff);
  };
  const Vector3 x = Vector3::UnitX();
  const Vector3 z = Vector3::UnitZ();
  // Directions have any length; distances are in metres.
  expect_hit(plane_shape(), {1, 2, 3}, -5.0 * z, 3.0, z);
  expect_hit(plane_shape(), {0, 0, 3}, {4, 0, -3}, 5.0, z);
  expect_hit(sphere_shape(0.5), {-2, 0, 0}, x, 1.5, -x);
  expect_hit(sphere_shape(0.5), {-2, 0.3, 0}, x, 1.6, Vector3(-0.8, 0.6, 0));
  expect_hit(box_shape({0.1, 0.2, 0.3}), {-1, 0.1, 0.1}, x, 0.9, -x);
  expect_hit(box_shape({0.1, 0.2, 0.3}), {0, 0, 1}, -z, 0.7, z);
  expect_hit(capsule_shape(0.2, 0.5), {0, 0, 2}, -z, 1.3, z);
  expect_hit(capsule_shape(0.2, 0.5), {-1, 0, 0.4}, x, 0.8, -x);
  expect_hit(capsule_shape(0.5, 0.5), {-2, 0, 0.8}, x, 1.6, Vector3(-0.8, 0, 0.6));
  expect_hit(cylinder_shape(0.2, 0.5), {0.1, 0, 2}, -z, 1.5, z);
  expect_hit(cylinder_shape(0.5, 0.5), {-2, 0.3, 0.4}, x, 1.6, Vector3(-0.8, 0.6, 0));
  expect_hit(prism_shape(4, 0.5, 0.3), {0, 0.1, -1}, z, 0.7, -z);
}

TEST(Ray, MissesBehindBesideBeyond) {
  const Shape ball = sphere_shape(0.5);
  const Vector3 x = Vector3::UnitX();
  EXPECT_FALSE(cast_ray(ball, Pose{}, {2, 0, 0}, x)) << "behind";
  EXPECT_FALSE(cast_ray(ball, Pose{}, {-2, 0.51, 0}, x)) << "beside";
  EXPECT_FALSE(cast_ray(ball, Pose{}, {-2, 0, 0}, x, 1.4)) << "beyond";
  EXPECT_TRUE(cast_ray(ball, Pose{}, {-2, 0, 0}, x, 1.6));
  EXPECT_FALSE(cast_ray(plane_shape(), Pose{}, {0, 0, 1}, x)) << "along the plane";
  EXPECT_FALSE(cast_ray(cylinder_shape(0.2, 0.5), Pose{}, {0.3, 0, 2}, -Vector3::UnitZ()));
}

TEST(Ray, StartingInsideHitsAtOnce) {
  for (const Shape& shape :
       {plane_shape(), sphere_shape(0.5), box_shape({1, 1, 1}), capsule_shape(0.2, 0.5),
        cylinder_shape(0.2, 0.5), prism_shape(5, 1, 1)}) {
    const Vector3 origin(0.01, 0.02, -0.03);
    const auto hit = cast_ray(shape, Pose{}, origin, {0, 1, 0});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->distance, 0.0);
    EXPECT_EQ(hit->position, origin);
    EXPECT_EQ(hit->normal, Vector3(0, -1, 0));
  }
}

TEST(Ray, SenselessRaysAreRefused) {
  const Shape ball = sphere_shape(0.5);
  EXPECT_THROW(cast_ray(ball, Pose{}, {0, 0, 0}, {0, 0, 0}), InputError);
  EXPECT_THROW(cast_ray(ball, Pose{}, {0, 0, 0}, {0, NAN, 1}), InputError);
  EXPECT_THROW(cast_ray(ball, Pose{}, {0, kInfinity, 0}, {0, 0, 1}), InputError);
}

// The hit lies on the surface and the ray before it is outside; without a hit the whole ray is
// outside. Away from edges the normal is that of the distance to a ball at the hit.
TEST(Ray, RandomRaysAgainstMembership) {
  std::mt19937 rng(8);
  for (const Shape& shape :
       {plane_shape(), sphere_shape(0.4), box_shape({0.3, 0.5, 0.2}), capsule_shape(0.2, 0.5),
        cylinder_shape(0.3, 0.4), cylinder_shape(0.5, 0.02), prism_shape(7, 0.4, 0.3, 0.6)}) {
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
      const Pose X = random_pose(rng, 0.5);
      const Vector3 origin = X.translation + 1.5 * random_unit(rng);
      const Vector3 direction = (X.translation + 0.5 * random_unit(rng) - origin).normalized();
      if (level(shape, X, origin) <= 0.0) continue;
      const auto hit = cast_ray(shape, X, origin, direction, 5.0);
      const double reach = hit ? hit->distance : 5.0;
      for (int k = 0; k < 50; ++k) {
        EXPECT_GE(level(shape, X, origin + (k / 50.0) * reach * direction), 0.0) << i;
      }
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(level(shape, X, hit->position), 0.0, kRoundOff) << i;
      EXPECT_NEAR(hit->normal.norm(), 1.0, kRoundOff);
      EXPECT_LE(hit->normal.dot(direction), 0.0);
      // A point at distance kOff from the hit along the normal is kOff away from the shape.
      constexpr double kOff = 0.1;
      EXPECT_NEAR(collision::distance(shape, X, sphere_shape(0.0),
                                      {Matrix3::Identity(), hit->position + kOff * hit->normal})
                      ->gap,
                  kOff, 1e-9)
          << i;
    }
    EXPECT_GT(hits, 500);
  }
}

// A ball, a box and a ground plane, with the ball 0.1 m above the box.
class Scenery : public ::testing::Test {
 protected:
  static Model make() {
    ModelBuilder builder;
    builder.add_environment("ground", plane_shape(), Pose{}, Material{});
    const auto add = [&](const std::string& name, const Shape& shape, const Pose& X) {
      RobotSpec robot;
      robot.name = name;
      LinkSpec link;
      link.name = "body";
      link.inertia = {1.0, Vector3::Zero(), Matrix3::Identity()};
      LinkSpec::Collision c;
      c.shape = shape;
      link.collisions.push_back(c);
      robot.links.push_back(link);
      builder.add_robot(robot, Base::kFloating, X, name + "/");
    };
    add("box", box_shape({0.5, 0.5, 0.5}), at(0, 0, 0.5));
    add("ball", sphere_shape(0.2), at(0, 0, 1.3));
    return builder.build();
  }
  const Model model = make();
  SceneQuery query{model};
};

TEST_F(Scenery, RayFindsTheNearest) {
  const auto down = query.cast_ray({0, 0, 5}, {0, 0, -1});
  ASSERT_TRUE(down);
  EXPECT_EQ(down->geometry, 2);
  EXPECT_NEAR(down->distance, 3.5, kRoundOff);
  const auto beside = query.cast_ray({0.4, 0, 5}, {0, 0, -1});
  ASSERT_TRUE(beside);
  EXPECT_EQ(beside->geometry, 1);
  EXPECT_NEAR(beside->distance, 4.0, kRoundOff);
  const auto ground = query.cast_ray({3, 0, 5}, {0, 0, -1});
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->geometry, 0);
  EXPECT_FALSE(query.cast_ray({0, 0, 5}, {0, 0, 1}));
  EXPECT_FALSE(query.cast_ray({0, 0, 5}, {0, 0, -1}, 3.0));
}

TEST_F(Scenery, DistanceOverlapsAndContactsOfAPose) {
  const auto d = query.distance(1, 2);
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->gap, 0.1, kRoundOff);
  EXPECT_TRUE(query.overlaps().empty());
  // Box and ground within a margin of 1 cm; with 0.2 m also ball and box.
  EXPECT_EQ(query.contacts(0.01).size(), 4u);
  EXPECT_EQ(query.contacts(0.2).size(), 5u);
  // The ball overlaps the box.
  query.set_poses(std::vector<Pose>{Pose{}, at(0, 0, 0.5), at(0, 0, 1.15)});
  EXPECT_EQ(query.overlaps(), (std::vector<std::pair<int, int>>{{1, 2}}));
  const auto contacts = query.contacts();
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].gap, -0.05, kRoundOff);
}

TEST_F(Scenery, IsThereRoom) {
  EXPECT_EQ(query.overlaps(sphere_shape(0.1), at(2, 0, 1)), std::vector<int>{});
  EXPECT_EQ(query.overlaps(sphere_shape(0.1), at(2, 0, 0.05)), std::vector<int>{0});
  EXPECT_EQ(query.overlaps(box_shape({5, 5, 5}), at(0, 0, 4)), (std::vector<int>{0, 1, 2}));
}

TEST_F(Scenery, WrongNumberOfPosesIsRefused) {
  EXPECT_THROW(query.set_poses(std::vector<Pose>(2)), InputError);
}

}  // namespace
}  // namespace counterpoint::test::query_test
