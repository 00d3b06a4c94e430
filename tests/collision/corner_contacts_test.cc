// Contacts added to the manifolds of fast slender bodies.
#include "counterpoint/collision/pairs/corner_contacts.h"

#include <gtest/gtest.h>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::corner_contacts_test {
namespace {

using collision::core_ball;
using collision::enclose;

std::vector<Shape> slender() {
  return {box_shape({0.1, 0.1, 0.0005}), capsule_shape(0.002, 0.25), cylinder_shape(0.002, 0.25),
          cylinder_shape(0.1, 0.001), prism_shape(6, 0.003, 0.25)};
}

// The ball lies within the shape: its support height never exceeds the shape's.
TEST(CoreBall, IsInsideTheShape) {
  std::mt19937 rng(3);
  for (const Shape& shape : slender()) {
    const Pose X = random_pose(rng, 1.0);
    const auto ball = core_ball(shape, enclose(shape), X, 1.0);
    ASSERT_TRUE(ball);
    EXPECT_GT(ball->shape.size[0], 0.0);
    for (int i = 0; i < 200; ++i) {
      const Vector3 n = random_unit(rng);
      EXPECT_LE(support_height(ball->shape, ball->X, n), support_height(shape, X, n) + 1e-12);
    }
  }
}

TEST(CoreBall, OnlyForWhatIsSlenderAndFast) {
  for (const Shape& shape : slender()) {
    // The displacement in one step of free fall or of walking: 5 mm.
    EXPECT_FALSE(core_ball(shape, enclose(shape), Pose{}, 0.005));
    EXPECT_TRUE(core_ball(shape, enclose(shape), Pose{}, 0.1));
  }
  for (const Shape& shape : {sphere_shape(0.01), box_shape({0.01, 0.01, 0.01}), plane_shape(),
                             cylinder_shape(0.01, 0.01)}) {
    EXPECT_FALSE(core_ball(shape, enclose(shape), Pose{}, 1.0));
  }
}

// A rod passes through a wall. While its centre is outside, the ball's contact pushes it to the
// centre's side.
TEST(CoreBall, PointsToTheSideOfTheMiddle) {
  const Shape wall = box_shape({5.0, 5.0, 0.0005});
  const Shape rod = capsule_shape(0.002, 0.25);
  for (const double side : {-1.0, 1.0}) {
    for (const double height : {0.2, 0.01, 0.003, 0.0015}) {
      const Pose X{Matrix3::Identity(), Vector3(0.1, 0.2, side * height)};
      const auto ball = core_ball(rod, enclose(rod), X, 1.0);
      ASSERT_TRUE(ball);
      Manifold m;
      find_core_contact(*ball, wall, Pose{}, 1.0, m);
      ASSERT_EQ(m.size, 1);
      EXPECT_NEAR(m.points[0].normal.z(), -side, 1e-12);  // from the ball to the wall
      EXPECT_NEAR(m.points[0].gap, height - 0.0025, 1e-12);
    }
    // With the centre inside the wall, the side is unknown.
    Manifold m;
    const auto ball =
        core_ball(rod, enclose(rod), {Matrix3::Identity(), Vector3(0, 0, 0.0002)}, 1.0);
    find_core_contact(*ball, wall, Pose{}, 1.0, m);
    EXPECT_EQ(m.size, 0);
  }
}

}  // namespace
}  // namespace counterpoint::test::corner_contacts_test
