// Compares simulations of different friction with a recording, which is simulated here first.
#include <counterpoint/engine/engine.h>
#include <counterpoint/engine/estimate/estimate.h>
#include <counterpoint/engine/trajectory.h>

#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace cp = counterpoint;
namespace est = counterpoint::estimation;

/// Writes every fifth step of 0.5 s of motion as a table, like one from motion capture, and a map
/// from its columns to coordinates: here the columns have the names used in trajectories.
void record(const cp::Scene& scene, const std::string& table, const std::string& map) {
  cp::Simulator sim(scene);
  cp::TrajectoryWriter rows(table, sim.model());
  for (int k = 0; k < 250; ++k) {
    if (k % 5 == 0) rows.write_step(sim.state(), sim.input(), sim.options().time_step);
    sim.step();
  }
  rows.write_end(sim.state());
  std::ofstream text(map);
  text << "time: time\nfree: cube\ncolumns:\n";
  const cp::CoordinateNames names = cp::coordinate_names(sim.model());
  for (const auto* list : {&names.q, &names.v})
    for (const std::string& name : *list) text << "  " << name << ": " << name << "\n";
}

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  const cp::Scene scene = cp::load_scene(data + "/scenes/cube_toss.yaml");
  record(est::with_settings(scene, "friction=0.1"), "toss.csv", "toss.yaml");

  const est::ColumnMap map = est::load_column_map("toss.yaml", scene.model);
  const std::vector<est::Recording> recordings = est::read_all({"toss.csv"}, map, scene);
  for (const char* friction : {"0.05", "0.1", "0.2"}) {
    const cp::Scene tried = est::with_settings(scene, std::string("friction=") + friction);
    est::Predictor predictor(tried, map, {map.substeps, tried.options.time_step});
    const est::Prediction prediction = predictor.predict(recordings.front());
    std::cout << "friction " << friction << ": mean error " << prediction.mean.position << " m, "
              << prediction.mean.rotation << " degrees\n";
  }
}
