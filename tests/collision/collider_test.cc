// The collider: filters, order, determinism and memory, against single queries of all pairs.
#include "counterpoint/collision/collider.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <numbers>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/spatial.h"
#include "support/allocation_guard.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::collider_test {
namespace {

using collision::Candidate;
using collision::Collider;

SpatialInertia unit_inertia() { return {1.0, Vector3::Zero(), Matrix3::Identity()}; }

LinkSpec link(const std::string& name, const std::vector<Shape>& shapes) {
  LinkSpec spec;
  spec.name = name;
  spec.inertia = unit_inertia();
  for (const Shape& shape : shapes) {
    LinkSpec::Collision collision;
    collision.shape = shape;
    spec.collisions.push_back(collision);
  }
  return spec;
}

RobotSpec free_object(const Shape& shape) {
  RobotSpec robot;
  robot.name = "object";
  robot.links.push_back(link("body", {shape}));
  return robot;
}

// Links in a row along x, `pitch` apart, connected by hinges about z.
RobotSpec chain(const std::vector<Shape>& shapes, double pitch = 1.0) {
  RobotSpec robot;
  robot.name = "chain";
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    robot.links.push_back(link("link" + std::to_string(i), {shapes[i]}));
    if (i == 0) continue;
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = "link" + std::to_string(i - 1);
    joint.child = "link" + std::to_string(i);
    joint.X_PJ.translation = Vector3(pitch, 0, 0);
    joint.axis = Vector3::UnitZ();
    robot.joints.push_back(joint);
  }
  return robot;
}

std::vector<double> margins(const Model& model, double margin) {
  return std::vector<double>(model.num_bodies(), 0.5 * margin);
}

TEST(Collider, NeighboursInAChainNeverTouchOthersDo) {
  ModelBuilder builder;
  const std::vector<Shape> balls(4, sphere_shape(0.1));
  builder.add_robot(chain(balls), Base::kFixed, Pose{});
  const Model model = builder.build();
  Collider collider(model);
  // The three pairs of links without a common joint, of six.
  EXPECT_EQ(collider.num_enabled_pairs(), 3);
  EXPECT_EQ(collider.num_joined_pairs(), 3);
  EXPECT_TRUE(collider.overlapping_pairs().empty());
  // All links at the same pose.
  std::vector<Candidate> out;
  collider.compute_candidates(std::vector<Pose>(model.num_bodies()), margins(model, 0.01), out);
  ASSERT_EQ(out.size(), 3u);
  const std::vector<std::pair<int, int>> expected = {{0, 2}, {0, 3}, {1, 3}};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(std::pair(out[i].geometry_a, out[i].geometry_b), expected[i]);
  }
}

TEST(Collider, PairsOverlappingByDefaultAreLeftOutAndNamed) {
  ModelBuilder builder;
  // Radius 1.1 m, 1 m apart: links two joints apart overlap at a distance of 2 m.
  const std::vector<Shape> balls(4, sphere_shape(1.1));
  builder.add_robot(chain(balls), Base::kFloating, Pose{});
  const Model model = builder.build();
  const Collider collider(model);
  const std::vector<std::pair<int, int>> expected = {{0, 2}, {1, 3}};
  EXPECT_EQ(collider.overlapping_pairs(), expected);
  EXPECT_EQ(collider.num_enabled_pairs(), 1);
}

TEST(Collider, EnvironmentMeetsEveryLinkAndNotItself) {
  ModelBuilder builder;
  builder.add_environment("ground", plane_shape(), Pose{}, Material{});
  builder.add_environment("table", box_shape({1, 1, 1}), Pose{}, Material{});
  const std::vector<Shape> balls(3, sphere_shape(0.1));
  builder.add_robot(chain(balls), Base::kFixed, Pose{});
  const Model model = builder.build();
  const Collider collider(model);
  // The base is welded to the world like ground and table, so only two links move. Each can meet
  // ground and table, the last also the base.
  EXPECT_EQ(collider.num_enabled_pairs(), 5);
  // Overlap with the environment is a contact, not an error of the robot.
  EXPECT_TRUE(collider.overlapping_pairs().empty());
}

TEST(Collider, ExcludedPairsNeverTouch) {
  ModelBuilder builder;
  const std::vector<Shape> balls(3, sphere_shape(0.1));
  builder.add_robot(chain(balls), Base::kFixed, Pose{});
  builder.exclude_pair("link0", "link2");
  const Model model = builder.build();
  Collider collider(model);
  EXPECT_EQ(collider.num_enabled_pairs(), 0);
  std::vector<Candidate> out;
  collider.compute_candidates(std::vector<Pose>(model.num_bodies()), margins(model, 0.01), out);
  EXPECT_TRUE(out.empty());
}

// On a plane the ends of a capsule carry it at any speed. The ball that keeps the middle of a fast
// slender body from passing another one gets a contact only where an end has turned deep into the
// plane: a third contact would carry a third of the load at some speeds.
TEST(Collider, ACapsuleOnThePlaneHasTwoContactsAtAnySpeed) {
  constexpr double kRadius = 0.03, kHalf = 0.07;
  ModelBuilder builder;
  builder.add_environment("ground", plane_shape(), Pose{}, Material{});
  builder.add_robot(chain({capsule_shape(kRadius, kHalf)}), Base::kFloating, Pose{});
  const Model model = builder.build();
  Collider collider(model);
  const auto contacts = [&](double height, double tilt, double travel) {
    std::vector<Pose> X_WB(model.num_bodies());
    const double quarter = 0.5 * std::numbers::pi;
    X_WB[1].rotation = rotation_from_rpy(0.0, quarter + tilt, 0.0);
    X_WB[1].translation.z() = height;
    std::vector<Candidate> out;
    const std::vector<double> travels(model.num_bodies(), travel);
    collider.compute_candidates(X_WB, margins(model, 0.1), out, travels);
    return out.size();
  };
  for (const double travel : {0.0, 0.01, 0.05, 10.0}) {
    EXPECT_EQ(contacts(kRadius - 0.004, 0.0, travel), 2u) << travel;
    EXPECT_EQ(contacts(kRadius + 0.004, 0.01, travel), 2u) << travel;
  }
  EXPECT_EQ(contacts(kRadius, 0.5, 0.0), 2u);
  EXPECT_EQ(contacts(kRadius, 0.5, 10.0), 3u);  // one end is 3.4 cm deep, more than the radius
}

// Free objects of every shape above a plane at random poses.
class Heap : public ::testing::Test {
 protected:
  static Model make() {
    ModelBuilder builder;
    builder.add_environment("ground", plane_shape(), Pose{}, Material{});
    const std::vector<Shape> shapes = {sphere_shape(0.2),        box_shape({0.1, 0.2, 0.3}),
                                       capsule_shape(0.1, 0.2),  cylinder_shape(0.2, 0.1),
                                       prism_shape(6, 0.2, 0.1), prism_shape(20, 0.2, 0.1, 0.5)};
    for (int i = 0; i < 90; ++i) {
      builder.add_robot(free_object(shapes[i % shapes.size()]), Base::kFloating, Pose{},
                        std::to_string(i) + "/");
    }
    return builder.build();
  }
  std::vector<Pose> poses() {
    std::vector<Pose> X_WB(model.num_bodies());
    for (std::size_t i = 1; i < X_WB.size(); ++i) X_WB[i] = random_pose(rng, 1.0);
    return X_WB;
  }
  const Model model = make();
  std::mt19937 rng{7};
  std::vector<Candidate> out;
};

TEST_F(Heap, FindsWhatAllPairsFindInOrder) {
  Collider collider(model);
  const double margin = 0.03;
  for (int k = 0; k < 5; ++k) {
    const std::vector<Pose> X_WB = poses();
    collider.compute_candidates(X_WB, margins(model, margin), out);
    std::size_t next = 0;
    const std::vector<Geometry>& g = model.geometries();
    for (std::size_t a = 0; a < g.size(); ++a) {
      for (std::size_t b = a + 1; b < g.size(); ++b) {
        if (g[a].body == g[b].body) continue;
        Manifold m;
        collision::pair_contacts(g[a].shape, X_WB[g[a].body] * g[a].X_BG, g[b].shape,
                                 X_WB[g[b].body] * g[b].X_BG, margin, m);
        for (int i = 0; i < m.size; ++i, ++next) {
          ASSERT_LT(next, out.size());
          EXPECT_EQ(out[next].geometry_a, static_cast<int>(a));
          EXPECT_EQ(out[next].geometry_b, static_cast<int>(b));
          EXPECT_EQ(out[next].gap, m.points[i].gap);
          EXPECT_EQ(out[next].position, m.points[i].position);
          EXPECT_EQ(out[next].normal, m.points[i].normal);
        }
      }
    }
    EXPECT_EQ(next, out.size());
    EXPECT_GT(out.size(), 100u);
  }
}

// No contact gap is below the bound from the enclosing balls, and contacts of separated shapes lie
// between the shapes.
TEST_F(Heap, WhereaboutsBoundGapsAndPlaces) {
  constexpr double kPlace = 1e-7;  // accuracy of narrow-phase positions [m]
  Collider collider(model);
  const std::vector<double> margin = margins(model, 0.3);
  int apart = 0;
  for (int k = 0; k < 5; ++k) {
    const std::vector<Pose> X_WB = poses();
    const auto close = collider.find_close_pairs(X_WB, margin);
    const std::vector<std::pair<int, int>> pairs(close.begin(), close.end());
    for (const auto& pair : pairs) {
      const auto [gap, middle, radius] = collider.whereabouts(pair.first, pair.second);
      out.clear();
      collider.add_candidates({X_WB, margin}, pair, out);
      for (const Candidate& c : out) {
        EXPECT_GE(c.gap, gap);
        if (!(gap > 0.0)) continue;  // overlapping shapes touch in the middle of the overlap
        EXPECT_LE((c.position - middle).norm(), radius + c.gap + kPlace);
        ++apart;
      }
    }
  }
  EXPECT_GT(apart, 100);
}

TEST_F(Heap, RemembersNothing) {
  Collider used(model);
  const std::vector<Pose> X_WB = poses();
  for (int k = 0; k < 3; ++k) used.compute_candidates(poses(), margins(model, 0.1), out);
  used.compute_candidates(X_WB, margins(model, 0.02), out);
  Collider fresh(model);
  std::vector<Candidate> again;
  fresh.compute_candidates(X_WB, margins(model, 0.02), again);
  ASSERT_EQ(out.size(), again.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ(out[i].position, again[i].position);
    EXPECT_EQ(out[i].normal, again[i].normal);
    EXPECT_EQ(out[i].gap, again[i].gap);
  }
}

TEST_F(Heap, NoAllocationAfterWarmUp) {
  if (!counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  Collider collider(model);
  const std::vector<Pose> X_WB = poses();
  const std::vector<double> margin = margins(model, 0.02);
  collider.compute_candidates(X_WB, margin, out);
  const std::size_t before = allocation_count();
  collider.compute_candidates(X_WB, margin, out);
  EXPECT_EQ(allocation_count(), before);
}

// A body with a non-finite pose touches nothing and leaves the contacts of the others unchanged.
TEST_F(Heap, PosesThatAreNotFiniteTouchNothing) {
  Collider collider(model);
  const std::vector<double> margin = margins(model, 0.02);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<Pose> X_WB = poses();
  collider.compute_candidates(X_WB, margin, out);
  const std::vector<Candidate> sound = out;
  for (const double bad : {nan, inf, -inf, 1e300}) {
    std::vector<Pose> X_bad = X_WB;
    for (std::size_t i = 1; i < X_bad.size(); i += 4) {
      X_bad[i].translation[i % 3] = bad;
      if (i % 8 == 1) X_bad[i].rotation.setConstant(bad);
    }
    collider.compute_candidates(X_bad, margin, out);
    std::size_t next = 0;
    for (const Candidate& c : sound) {
      const int body_a = model.geometries()[c.geometry_a].body;
      const int body_b = model.geometries()[c.geometry_b].body;
      if ((body_a > 0 && body_a % 4 == 1) || body_b % 4 == 1) continue;
      ASSERT_LT(next, out.size());
      EXPECT_EQ(out[next].position, c.position);
      EXPECT_EQ(out[next++].gap, c.gap);
    }
    EXPECT_EQ(next, out.size()) << bad;
    EXPECT_GT(next, 20u);
  }
}

}  // namespace
}  // namespace counterpoint::test::collider_test
