// Runs with step control, and the pendulum that they are measured on.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/simulator.h"

namespace counterpoint::test {

/// Two rods of 1 m and 1 kg on revolute joints about y, released at (2, 1) rad; smooth motion.
inline Scene double_pendulum() {
  RobotSpec robot;
  robot.name = "pendulum";
  robot.links.resize(3);
  for (int i = 0; i < 3; ++i) robot.links[i].name = "link" + std::to_string(i);
  for (int i = 1; i < 3; ++i) {
    robot.links[i].inertia =
        SpatialInertia{1.0, Vector3(0, 0, -0.5), Vector3(0.1, 0.1, 0.01).asDiagonal()};
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.type = JointType::kRevolute;
    joint.axis = Vector3(0, 1, 0);
    joint.parent = robot.links[i - 1].name;
    joint.child = robot.links[i].name;
    if (i == 2) joint.X_PJ.translation.z() = -1.0;
    robot.joints.push_back(joint);
  }
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose(), "");
  Model model = builder.build();
  VectorX q = VectorX::Zero(2), v = VectorX::Zero(2);
  q << 2.0, 1.0;
  return {"double pendulum", std::move(model), q, v, SimulationOptions()};
}

inline Simulator controlled(Scene scene, Integrator integrator, double tolerance) {
  scene.options.integrator = integrator;
  scene.options.step_control.emplace();
  scene.options.step_control->tolerance = tolerance;
  return Simulator(std::move(scene));
}

/// Steps of a controlled run.
struct Steps {
  long accepted = 0, rejected = 0, impacts = 0, missed = 0;
  double longest = 0.0;  ///< longest step [s]
};

/// Runs to `end` [s], or to the first step that fails; `after` is called with each step's report
/// and the state before it.
template <class After>
Steps run_until(Simulator& sim, double end, After after) {
  Steps run;
  while (sim.state().time < end) {
    const State before = sim.state();
    const double landing = next_landing(*sim.options().step_control, before.time, end);
    const ControlledReport step = sim.step_controlled(landing);
    EXPECT_TRUE(step.succeeded()) << before.time;
    if (!step.succeeded()) break;
    ++run.accepted;
    run.rejected += step.rejected;
    run.impacts += step.impact;
    run.missed += step.missed;
    run.longest = std::max(run.longest, step.step);
    after(step, before);
  }
  return run;
}
inline Steps run_until(Simulator& sim, double end) {
  return run_until(sim, end, [](const ControlledReport&, const State&) {});
}

}  // namespace counterpoint::test
