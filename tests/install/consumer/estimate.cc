// A user program that estimates the damping of a joint from a recorded motion of a double pendulum.
#include <counterpoint/engine/engine.h>
#include <counterpoint/engine/estimate/estimate.h>

#include <cmath>
#include <iostream>

using namespace counterpoint;
namespace est = counterpoint::estimation;

/// Error from the round-off of the recovered forces; the residual is linear in the damping.
constexpr double kTolerance = 1e-6;
constexpr int kRows = 60;

int main(int, char** arguments) {
  const Scene scene = est::with_settings(load_scene(arguments[1]), "damping:elbow=0.25");
  Simulator simulator(scene);
  est::Recording recording;
  recording.q.resize(scene.model.nq(), kRows);
  recording.v.resize(scene.model.nv(), kRows);
  recording.applied_force = MatrixX::Zero(scene.model.nv(), kRows);
  for (int row = 0; row < kRows; ++row) {
    recording.time.push_back(simulator.state().time);
    recording.q.col(row) = simulator.state().q;
    recording.v.col(row) = simulator.state().v;
    if (!simulator.step().succeeded()) return 1;
  }

  est::Experiment experiment;
  experiment.scene = est::with_settings(scene, "damping:elbow=0.01");
  experiment.recordings = {recording};
  experiment.num_given = 1;
  for (int i = 0; i < scene.model.nv(); ++i) {
    experiment.map.entries.push_back({est::ColumnMap::Entry::Kind::kPosition, i, "q", {}});
    experiment.map.entries.push_back({est::ColumnMap::Entry::Kind::kForce, i, "u", {}});
  }
  const std::vector<est::Parameter> parameters =
      est::parse_parameters("damping:elbow", experiment.scene);
  const std::vector<int> all{0};
  const est::FitProblem problem = est::fit_problem(experiment, parameters, all, true);
  const double found = est::fit(problem, {}).values()[0];
  std::cout << "damping of the elbow: " << found << " N m s\n";
  return std::abs(found - 0.25) <= kTolerance * 0.25 ? 0 : 1;
}
