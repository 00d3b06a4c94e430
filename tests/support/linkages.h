// Linkages of rods, and their energy and closure errors while they move.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::test {

/// Returns a simulator of a model at rest in its default pose; time_step [s].
inline Simulator simulate(Model model, double time_step = 0.002) {
  Scene scene{"closures", std::move(model), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(scene.model.nv());
  scene.options.time_step = time_step;
  return Simulator(std::move(scene));
}

struct Energy {
  double kinetic, potential;  // [J]
  double total() const { return kinetic + potential; }
};

/// Computes poses, velocities and inertias at the simulator's state.
inline Data kinematics_of(const Simulator& sim) {
  Data data(sim.model());
  compute_poses(sim.model(), sim.state().q, data);
  compute_velocities(sim.model(), sim.state().v, data);
  compute_inertias(sim.model(), data);
  return data;
}

inline Energy energy(const Simulator& sim) {
  const Data data = kinematics_of(sim);
  return {kinetic_energy(sim.model(), sim.state().v, data), potential_energy(sim.model(), data)};
}

/// Returns the largest error over all closures [m or rad].
inline double open_by(const Simulator& sim) {
  const std::vector<Pose> X_WB = body_poses(sim.model(), sim.state().q);
  double worst = 0.0;
  for (const Closure& closure : sim.model().closures()) {
    const ClosureGap gap = closure_gap(closure, X_WB);
    worst = std::max({worst, std::abs(gap.distance), gap.angle});
  }
  return worst;
}

/// Gives all bodies random velocities up to `speed` [m/s, rad/s].
inline void set_random_velocities(Simulator& sim, double speed) {
  State start = sim.state();
  start.v = random_vector(sim.model().nv(), 11, speed);
  sim.set_state(start);
}

/// Expects the momentum of free bodies to stay in 1000 steps; calls after_step() after each.
template <class AfterStep>
void expect_momentum_kept(Simulator& sim, AfterStep after_step) {
  sim.settings().tolerance = 1e-12;
  const auto momentum = [&] { return total_momentum(sim.model(), kinematics_of(sim)); };
  const Force before = momentum();
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    after_step();
  }
  const Force after = momentum();
  // Rounding of momenta of 10 kg m/s over 1000 steps.
  EXPECT_LT((after.force - before.force).norm(), 1e-11);
  EXPECT_LT((after.torque - before.torque).norm(), 1e-11);
}

/// Expects that neither steps nor their inverses allocate after `warm_up` of both, which bring the
/// sizes of all paths of the solver.
inline void expect_no_allocations(Simulator& sim, int warm_up) {
  const auto round = [&] {
    const VectorX q = sim.state().q, v = sim.state().v;
    const std::size_t before = allocation_count();
    EXPECT_TRUE(sim.step().succeeded());
    sim.inverse(q, v, sim.state().v);
    return allocation_count() - before;
  };
  for (int i = 0; i < warm_up; ++i) round();
  for (int i = 0; i < 100; ++i) EXPECT_EQ(round(), 0u);
}

/// Adds a link, a thin rod of 1 kg/m from its origin to `along`, on a revolute joint about `axis`
/// at `at` on its parent. Its inertia is m l^2 / 12 across the rod and a little about it.
inline void add_rod(RobotSpec& robot, const std::string& name, const std::string& parent,
                    const std::string& joint_name, const Vector3& at, const Vector3& along,
                    const Vector3& axis) {
  const double mass = along.norm();
  const Matrix3 square = along * along.transpose();
  LinkSpec link;
  link.name = name;
  const Matrix3 across = along.squaredNorm() * Matrix3::Identity() - square;
  link.inertia = {mass, 0.5 * along, mass / 12.0 * across + 1e-4 / mass * square};
  robot.links.push_back(link);
  JointSpec joint;
  joint.name = joint_name;
  joint.parent = parent;
  joint.child = name;
  joint.axis = axis;
  joint.X_PJ.translation = at;
  robot.joints.push_back(joint);
}

/// Returns a robot with a base link and nothing else yet.
inline RobotSpec base_only(const std::string& name, const std::string& base_name) {
  RobotSpec robot;
  robot.name = name;
  LinkSpec base;
  base.name = base_name;
  robot.links.push_back(base);
  return robot;
}

/// A chain of bars of 1 kg/m in the plane y = 0 on revolute joints, attached to the world at the
/// origin, with these initial joint angles (positive: downwards). `count` closures hold its tip
/// where it starts.
struct FourBar {
  Vector3 angles = Vector3(0.0, -0.4, -0.9);
  ClosureType type = ClosureType::kBall;
  int count = 1;
};

inline constexpr double kBars[3] = {0.3, 0.8, 0.6};  // [m]

inline Model make_four_bar(const FourBar& four_bar) {
  RobotSpec robot = base_only("four_bar", "link0");
  for (int i = 0; i < 3; ++i) {
    const double before = i > 0 ? kBars[i - 1] : 0.0;
    add_rod(robot, "link" + std::to_string(i + 1), "link" + std::to_string(i),
            "joint" + std::to_string(i + 1), before * Vector3::UnitX(), kBars[i] * Vector3::UnitX(),
            Vector3::UnitY());
  }
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  for (int i = 0; i < 3; ++i)
    builder.set_default_position("joint" + std::to_string(i + 1),
                                 VectorX::Constant(1, four_bar.angles[i]));
  ClosureSpec closure;
  closure.type = four_bar.type;
  closure.link_a = "link3";
  closure.link_b = "world";
  closure.anchor_a = Vector3(kBars[2], 0, 0);
  for (int i = 0; i < four_bar.count; ++i) builder.add_closure(closure);
  return builder.build();
}

struct Swing {
  double open = 0.0, speed = 0.0, drift = 0.0, kinetic = 0.0;  // largest [m, rad/s, J, J]
};

/// Runs for `duration` [s] and returns the largest values on the way.
inline Swing swing(Simulator& sim, double duration) {
  Swing run;
  const double start = energy(sim).total();
  const int steps = static_cast<int>(std::lround(duration / sim.options().time_step));
  for (int i = 0; i < steps; ++i) {
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << "step " << i << ": " << contact::status_name(report.status);
    if (!report.succeeded()) break;
    const Energy now = energy(sim);
    run.open = std::max(run.open, open_by(sim));
    run.speed = std::max(run.speed, sim.state().v.cwiseAbs().maxCoeff());
    run.drift = std::max(run.drift, std::abs(now.total() - start));
    run.kinetic = std::max(run.kinetic, now.kinetic);
  }
  return run;
}

}  // namespace counterpoint::test
