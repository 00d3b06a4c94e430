// Our trajectory optimization compared with MuJoCo MPC's `Direct` on one least-squares problem: a
// humanoid follows a glide over the ground that no forces allow, so that contacts have to be found.
// Usage: counterpoint_bench_direct [STEPS ...]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "peers/mpc/mujoco_direct.h"

namespace counterpoint::apps {
namespace {

namespace opt = optimization;

constexpr int kMost = 200;  ///< iterations of either method
constexpr double kLever =
    0.5;  ///< [m]: torques are divided by weight times this, as in unactuated_weights
constexpr double kPosture = 1.0;      ///< [1/m, 1/rad]
constexpr double kBaseWeight = 30.0;  ///< weight of the base's force over the scene's weight
constexpr double kMotorWeight = 2.0;  ///< weight of joint forces over effort limits
/// Smoothing [m] and compliance that make contacts about as soft as MuJoCo's defaults.
constexpr double kSmoothing = 1e-3, kCompliance = 0.1;

/// Progress of a method, iteration by iteration, and its final result.
struct Course {
  std::vector<double> cost;
  double seconds = 0.0, base = 0.0, forward = 0.0;

  /// Iterations until the cost is within 1 % of the last cost.
  int iterations() const {
    const auto found =
        std::find_if(cost.begin(), cost.end(), [&](double c) { return c <= 1.01 * cost.back(); });
    return static_cast<int>(found - cost.begin()) + 1;
  }
};

peers::DirectTask make_task(const opt::ProblemFile& file) {
  const Model& model = file.scene->model;
  peers::DirectTask task;
  task.scene = file.scene.get();
  task.targets = file.guess;
  task.pose_weight = VectorX::Constant(model.nv(), kPosture);
  task.force_weight = kBaseWeight * opt::unactuated_weights(model, opt::motors_of(model), kLever);
  for (int joint = 1; joint < model.num_joints(); ++joint)
    task.force_weight[model.body(joint + 1).v_index] =
        kMotorWeight / model.joint(joint).effort_limit;
  return task;
}

opt::Problem make_problem(const opt::ProblemFile& file, const peers::DirectTask& task) {
  opt::Problem problem = file.problem;
  problem.periodic = problem.settle = false;
  problem.mirror.reset();
  problem.goal_q.reset();
  problem.displacement.setZero();
  problem.start_q = task.targets.front();
  problem.start_v = VectorX::Zero(file.scene->model.nv());
  problem.options.contact.smoothing = kSmoothing;
  problem.options.contact.compliance = kCompliance;
  problem.terms.clear();
  opt::Term force;
  force.quantity = opt::Quantity::kAppliedForce;
  force.weight = task.force_weight;
  problem.terms.push_back(force);
  for (int t = 1; t <= problem.steps; ++t) {
    opt::Term pose;
    pose.weight = task.pose_weight;
    pose.target = task.targets[static_cast<std::size_t>(t)];
    pose.frames = {t, t};
    problem.terms.push_back(pose);
  }
  return problem;
}

Course ours(const opt::ProblemFile& file, const peers::DirectTask& task) {
  const opt::Problem problem = make_problem(file, task);
  opt::Newton newton(problem, task.targets, 0);
  opt::Stage stage;
  stage.options = problem.options;
  newton.begin(stage);
  Course course;
  const double start = wall_seconds();
  for (int i = 0; i < kMost; ++i) {
    const opt::Iteration step = newton.iterate();
    course.cost.push_back(newton.cost());
    if (!step.accepted || step.decrease < 1e-8) break;
  }
  course.seconds = wall_seconds() - start;
  const opt::Verification found = opt::verify(*problem.model, problem.options, problem.motors,
                                              newton.frames().all(), problem.start_v);
  course.base = found.unactuated_max;
  course.forward = found.forward_check_max;
  return course;
}

Course theirs(const peers::DirectTask& task, double weight) {
  Course course;
  peers::MujocoDirect by_steps(task);
  while (static_cast<int>(course.cost.size()) < kMost) {
    const double before = by_steps.cost();
    by_steps.iterate(1);
    if (!course.cost.empty() && !(before - by_steps.cost() > 1e-8)) break;
    course.cost.push_back(by_steps.cost());
  }
  course.base = std::max(by_steps.base_force(), by_steps.base_torque() / kLever) / weight;
  course.forward = by_steps.forward_check();
  // Repeated in a single call to measure its time.
  peers::MujocoDirect in_one(task);
  const double start = wall_seconds();
  const int done = in_one.iterate(static_cast<int>(course.cost.size()));
  course.seconds =
      (wall_seconds() - start) * static_cast<double>(course.cost.size()) / std::max(done, 1);
  return course;
}

void print(const std::string& name, int steps, const Course& c) {
  fmt::print("| {} | {} | {:.3g} | {} | {} | {:.4g} | {:.2g} | {:.2g} |\n", steps, name,
             1e3 * c.seconds / static_cast<double>(c.cost.size()), c.iterations(), c.cost.size(),
             c.cost.back(), c.base, c.forward);
}

void compare(int steps) {
  const std::string path =
      std::string(COUNTERPOINT_SOURCE_DIR) + "/data/scenes/optimize/humanoid_walk.yaml";
  const opt::ProblemFile file = opt::load_problem(path, steps);
  const peers::DirectTask task = make_task(file);
  print("Counterpoint", steps, ours(file, task));
  print("Direct", steps, theirs(task, opt::scene_weight(file.scene->model)));
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  fmt::print(
      "| steps | method | ms an iteration | iterations to 1 % of the last cost | in all | cost | "
      "base force over weight "
      "| forward step apart |\n|---|---|---|---|---|---|---|---|\n");
  if (argc < 2) counterpoint::apps::compare(16);
  for (int i = 1; i < argc; ++i) counterpoint::apps::compare(std::stoi(argv[i]));
}
