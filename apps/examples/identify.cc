// Finds the friction of a cube from a toss, which is simulated and recorded in memory.
#include <counterpoint/engine/engine.h>
#include <counterpoint/engine/estimate/estimate.h>

#include <iostream>
#include <string>
#include <vector>

namespace cp = counterpoint;
namespace est = counterpoint::estimation;

/// Records every fifth step of 0.5 s of motion. compare.cc reads a recording from a file instead.
est::Recording record(const cp::Scene& scene) {
  cp::Simulator sim(scene);
  est::Recording recording;
  recording.q.resize(scene.model.nq(), 51);
  recording.v.resize(scene.model.nv(), 51);
  recording.applied_force = cp::MatrixX::Zero(scene.model.nv(), 51);
  for (int row = 0; row < 51; ++row) {
    recording.time.push_back(sim.state().time);
    recording.q.col(row) = sim.state().q;
    recording.v.col(row) = sim.state().v;
    for (int k = 0; k < 5; ++k) sim.step();
  }
  return recording;
}

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  est::Experiment experiment;
  experiment.scene = cp::load_scene(data + "/scenes/cube_toss.yaml");
  experiment.map.free_body = 1;  // the cube, whose pose is compared; body 0 is the world
  experiment.recordings = {record(est::with_settings(experiment.scene, "friction=0.3"))};
  experiment.num_given = 1;
  experiment.by_score = true;
  const auto parameters = est::parse_parameters("friction=0.05..0.6", experiment.scene);
  const std::vector<int> all{0};  // indices of the recordings to fit
  est::FitOptions options;
  options.samples = 16;
  const est::Fit found = est::fit(est::fit_problem(experiment, parameters, all, false), options);
  std::cout << parameters[0].name << ": " << found.values()[0] << " (made with 0.3, the scene has "
            << est::parameter_values(parameters, experiment.scene)[0] << ")\n"
            << "cost " << found.start_cost << " -> " << found.cost << " in " << found.evaluations
            << " evaluations\n";
}
