// Optimizes two motions: an acrobot swings up; a pendulum is lifted with least effort.
#include <counterpoint/engine/engine.h>
#include <counterpoint/engine/optimize/optimize.h>

#include <iostream>
#include <numbers>
#include <string>

namespace cp = counterpoint;
namespace opt = counterpoint::optimization;

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  // A problem from a file, which defines scene, start, goal and terms.
  opt::ProblemFile file = opt::load_problem(data + "/scenes/optimize/acrobot.yaml");
  file.settings.progress = [](const opt::Progress& step) {
    if (step.iteration % 50 == 1) std::cout << "  cost " << step.cost << "\n";
    return true;  // false would stop the search
  };
  const opt::Result swing = opt::optimize(file.problem, file.guess, file.settings);
  const auto check = opt::verify(*file.problem.model, swing.options, file.problem.motors, swing.q,
                                 swing.v.front());
  std::cout << "swing-up: " << opt::outcome_name(swing.outcome)
            << "; steps done forward land within " << check.forward_check_max
            << " rad of the motion\n";

  // A problem without a file: least effort from hanging to rest at 90 degrees in one second.
  const cp::Scene scene = cp::load_scene(data + "/scenes/pendulum.yaml");
  opt::Problem lift;
  lift.model = &scene.model;
  lift.options = scene.options;
  lift.options.time_step = 0.02;  // [s]
  lift.steps = 50;
  lift.start_q = lift.start_v = lift.goal_v = cp::VectorX::Zero(1);
  lift.goal_q = cp::VectorX::Constant(1, std::numbers::pi / 2);  // [rad]
  lift.motors = opt::motors_of(scene.model);
  opt::Term& effort = lift.terms.emplace_back();
  effort.quantity = opt::Quantity::kAppliedForce;
  effort.weight = cp::VectorX::Ones(1);  // [1/(N m)]
  const auto guess = opt::straight_line(scene.model, lift.start_q, *lift.goal_q, lift.steps);
  const opt::Result motion = opt::optimize(lift, guess);
  std::cout << "lift: " << opt::outcome_name(motion.outcome) << "; torque from "
            << motion.applied_force.front()[0] << " to " << motion.applied_force.back()[0]
            << " N m\n";
}
