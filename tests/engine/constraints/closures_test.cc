// Closures: bodies that move as one, with an exact inverse. Linkages: linkages_test.cc.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/model/model.h"
#include "support/allocation_guard.h"
#include "support/linkages.h"
#include "support/recover.h"
#include "support/small_scenes.h"

namespace counterpoint::closures_test {
namespace {

using test::kRecovered;
using test::make_four_bar;
using test::open_by;
using test::recover;
using test::simulate;

/// `count` free bodies of the given inertia without geometry, `apart` [m] along x.
struct FreeBodies {
  ModelBuilder builder;
  explicit FreeBodies(int count, const SpatialInertia& inertia, const Vector3& gravity,
                      double apart = 0.3)
      : builder(gravity) {
    for (int i = 0; i < count; ++i) {
      RobotSpec robot;
      robot.name = "body";
      LinkSpec link;
      link.name = "body";
      link.inertia = inertia;
      robot.links.push_back(link);
      Pose X_WL;
      X_WL.translation.x() = apart * i;
      builder.add_robot(robot, Base::kFloating, X_WL, std::to_string(i) + "/");
    }
  }
};

SpatialInertia box_inertia(double mass, const Vector3& half) {
  return solid_inertia({ShapeType::kBox, half, nullptr}, mass);
}

TEST(ClosureInverse, RecoversForcesOnFreeBodies) {
  test::Random random(5);
  FreeBodies free(4, box_inertia(1.0, Vector3(0.1, 0.05, 0.15)), Vector3(0, 0, -9.81));
  ClosureSpec closure;
  const ClosureType types[] = {ClosureType::kBall, ClosureType::kWeld, ClosureType::kDistance};
  for (int i = 0; i < 3; ++i) {
    closure.type = types[i];
    closure.link_a = std::to_string(i) + "/body";
    closure.link_b = std::to_string(i + 1) + "/body";
    closure.anchor_a = Vector3(0.1, 0.02, 0.0);
    free.builder.add_closure(closure);
  }
  closure.type = ClosureType::kDistance;
  closure.link_a = "world";
  closure.link_b = "0/body";
  closure.anchor_a = Vector3(0, 0, 1);
  free.builder.add_closure(closure);
  Simulator sim = simulate(free.builder.build());
  EXPECT_LT(recover(sim, 500, 1.0, random), kRecovered);
}

TEST(Weld, HoldsABoxToTheWorldByItsWeight) {
  const double mass = 2.0, arm = 0.4;
  FreeBodies free(1, box_inertia(mass, Vector3::Constant(0.1)), Vector3(0, 0, -9.81));
  ClosureSpec weld;
  weld.type = ClosureType::kWeld;
  weld.link_a = "world";
  weld.link_b = "0/body";
  weld.anchor_b = Vector3(-arm, 0, 0);
  weld.anchor_a = Vector3(-arm, 0, 0);
  free.builder.add_closure(weld);
  Simulator sim = simulate(free.builder.build());
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
  ASSERT_EQ(inverse.closures.size(), 1u);
  const Force& force = inverse.closures[0].force;
  // Force on body B, the box, at the anchor: its weight, and the torque of its arm. The solver's
  // 1e-10.
  EXPECT_LT((force.force - Vector3(0, 0, mass * 9.81)).norm(), 1e-6);
  EXPECT_LT((force.torque - Vector3(0, -arm * mass * 9.81, 0)).norm(), 1e-6);
  // Sag: the recovery beta e / h balances the compliance r f. The rotational part is the larger
  // one: alpha is the mean of inv(I), I = m (2a)^2 / 6.
  const double h = sim.options().time_step, inertia = mass * 0.04 / 6.0;
  const ContactOptions& options = sim.options().contact;
  const double sag = kClosureSoftness * options.compliance / inertia * arm * mass * 9.81 * h * h /
                     options.stabilization;
  EXPECT_NEAR(open_by(sim), sag, 1e-3 * sag);
}

/// Two boxes side by side along x: one free body, or two that are welded.
Simulator two_boxes(bool welded, double h) {
  const Vector3 half(0.1, 0.05, 0.15);
  const double masses[2] = {1.0, 3.0};
  Model model = [&] {
    if (!welded) {
      SpatialInertia both = box_inertia(masses[0], half);
      both = both +
             box_inertia(masses[1], half).transformed({Matrix3::Identity(), Vector3(0.2, 0, 0)});
      return FreeBodies(1, both, Vector3::Zero()).builder.build();
    }
    ModelBuilder builder(Vector3::Zero());
    for (int i = 0; i < 2; ++i) {
      RobotSpec robot;
      robot.name = "box";
      LinkSpec link;
      link.name = "body";
      link.inertia = box_inertia(masses[i], half);
      robot.links.push_back(link);
      Pose X_WL;
      X_WL.translation.x() = 0.2 * i;
      builder.add_robot(robot, Base::kFloating, X_WL, std::to_string(i) + "/");
    }
    ClosureSpec weld;
    weld.type = ClosureType::kWeld;
    weld.link_a = "0/body";
    weld.link_b = "1/body";
    weld.anchor_a = Vector3(0.1, 0, 0);
    builder.add_closure(weld);
    return builder.build();
  }();
  Simulator sim = simulate(std::move(model), h);
  const Vector3 linear(0.3, -0.2, 0.1), angular(2.0, -1.5, 2.5);
  State start = sim.state();
  start.v.head<6>() << linear, angular;
  if (welded) start.v.tail<6>() << linear + angular.cross(Vector3(0.2, 0, 0)), angular;
  sim.set_state(start);
  return sim;
}

TEST(Weld, TwoFreeBoxesMoveAsOneBody) {
  // Both are of first order, with different errors. Each of the two boxes moves freely and the weld
  // corrects it; the centre of mass of the single body, which is not its origin, moves exactly
  // (free_groups.h). The difference must fall with h and be of the size of the single body's error
  // in rotation, which is measured against a step 16 times smaller.
  double open = 0.0, last_open = 0.0;
  const auto pose_after = [&](Simulator sim) {
    const int steps = static_cast<int>(std::lround(1.0 / sim.options().time_step));
    for (int i = 0; i < steps; ++i) {
      EXPECT_TRUE(sim.step().succeeded());
      open = std::max(open, open_by(sim));
    }
    return VectorX(sim.state().q.head(7));
  };
  const VectorX exact = pose_after(two_boxes(false, 0.004 / 64));
  double last = 0.0;
  for (const double h : {0.004, 0.002, 0.001}) {
    open = 0.0;
    const double error = (pose_after(two_boxes(true, h)) - exact).norm();
    const double own = (pose_after(two_boxes(false, h)) - exact).norm();
    EXPECT_LT(error, 4.0 * own) << h;
    if (last > 0.0) {
      EXPECT_NEAR(last / error, 2.0, 0.1) << h;
      EXPECT_GT(last_open / open, 6.0) << h;  // third order
    }
    last = error;
    last_open = open;
  }
}

/// Two point masses on rods of length l, released from the horizontal.
Simulator by_rods(double m, double l, double h) {
  ModelBuilder builder(Vector3(0, 0, -9.81));
  ClosureSpec rod;
  rod.type = ClosureType::kDistance;
  rod.link_a = "world";
  for (int i = 0; i < 2; ++i) {
    RobotSpec robot;
    robot.name = "bob";
    LinkSpec link;
    link.name = "body";
    link.inertia = {m, Vector3::Zero(), 1e-3 * Matrix3::Identity()};
    robot.links.push_back(link);
    Pose X_WL;
    X_WL.translation.x() = l * (i + 1);
    builder.add_robot(robot, Base::kFloating, X_WL, std::to_string(i) + "/");
    rod.link_b = std::to_string(i) + "/body";
    builder.add_closure(rod);
    rod.link_a = rod.link_b;
  }
  return simulate(builder.build(), h);
}

/// The same in joint coordinates, a pendulum of two revolute joints.
Simulator by_joints(double m, double l, double h) {
  RobotSpec robot;
  robot.name = "pendulum";
  robot.links.resize(3);
  for (int i = 0; i < 3; ++i) {
    robot.links[i].name = "link" + std::to_string(i);
    if (i == 0) continue;
    robot.links[i].inertia = {m, Vector3(l, 0, 0), Matrix3::Zero()};
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = "link" + std::to_string(i - 1);
    joint.child = "link" + std::to_string(i);
    joint.axis = Vector3::UnitY();
    if (i > 1) joint.X_PJ.translation.x() = l;
    robot.joints.push_back(joint);
  }
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  return simulate(builder.build(), h);
}

TEST(Distance, TwoFreeSpheresOnRodsAreADoublePendulum) {
  // Two point masses on rods of 0.5 m, released from the horizontal, against joint coordinates.
  const double m = 1.0, l = 0.5;
  const auto run = [](Simulator sim, double& open) {
    const int steps = static_cast<int>(std::lround(1.0 / sim.options().time_step));
    for (int i = 0; i < steps; ++i) {
      EXPECT_TRUE(sim.step().succeeded());
      open = std::max(open, open_by(sim));
    }
    return sim.state().q;
  };
  const auto bobs_of = [&](const VectorX& q) {  // x and z of both
    Eigen::Vector4d bobs;
    bobs << l * std::cos(q[0]), -l * std::sin(q[0]), 0, 0;
    bobs.tail<2>() =
        bobs.head<2>() + l * Eigen::Vector2d(std::cos(q[0] + q[1]), -std::sin(q[0] + q[1]));
    return bobs;
  };
  double open_joints = 0.0;
  const Eigen::Vector4d exact = bobs_of(run(by_joints(m, l, 1e-5), open_joints));
  double last_error = 0.0, last_open = 0.0;
  for (const double h : {0.004, 0.002, 0.001}) {
    double open = 0.0;
    const VectorX x = run(by_rods(m, l, h), open);
    const double error = (Eigen::Vector4d(x[0], x[2], x[7], x[9]) - exact).norm();
    const double own = (bobs_of(run(by_joints(m, l, h), open_joints)) - exact).norm();
    // First order, equal to joint coordinates to second order; the length has an error of third
    // order.
    EXPECT_NEAR(error / own, 1.0, 5e3 * h * h) << h;  // measured: 3900 ... 4700 h^2
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error, 2.0, 0.25);
      EXPECT_GT(last_open / open, 7.0);
    }
    last_error = error;
    last_open = open;
  }
  EXPECT_LT(last_open, 1e-6);
}

TEST(Closures, BetweenFreeBodiesKeepMomentum) {
  // Spheres, whose spin is integrated exactly; the closures start up to 5 cm open and pull.
  FreeBodies free(4, {1.5, Vector3::Zero(), 0.01 * Matrix3::Identity()}, Vector3::Zero());
  const ClosureType types[] = {ClosureType::kBall, ClosureType::kWeld, ClosureType::kDistance};
  for (int i = 0; i < 3; ++i) {
    ClosureSpec closure;
    closure.type = types[i];
    closure.link_a = std::to_string(i) + "/body";
    closure.link_b = std::to_string(i + 1) + "/body";
    closure.anchor_a = Vector3(0.1, 0.05, 0.0);
    closure.anchor_b = Vector3(-0.15, 0.0, 0.02);
    free.builder.add_closure(closure);
  }
  Simulator sim = simulate(free.builder.build());
  test::set_random_velocities(sim, 2.0);
  test::expect_momentum_kept(sim, [] {});
  EXPECT_LT(open_by(sim), 1e-3);
}

TEST(Closures, StepAndInverseDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim = simulate(make_four_bar({.type = ClosureType::kBall, .count = 2}));
  test::expect_no_allocations(sim, 20);
}

}  // namespace
}  // namespace counterpoint::closures_test
