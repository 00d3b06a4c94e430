// Simulates a falling humanoid and writes its motion to fall.csv; then simulates 16 falls in
// parallel.
#include <counterpoint/engine/engine.h>
#include <counterpoint/engine/trajectory.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

namespace cp = counterpoint;

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  const cp::Scene scene = cp::load_scene(data + "/scenes/humanoid_drop.yaml");
  const double h = scene.options.time_step;  // [s]
  cp::Simulator sim(scene);
  cp::TrajectoryWriter motion("fall.csv", sim.model());
  std::vector<cp::TautLink> taut_links;
  int steps = 0;
  for (; sim.state().time < 1.0 - 0.5 * h; ++steps) {
    const cp::State before = sim.state();
    const cp::StepReport report = sim.step();
    if (!report.succeeded()) return 1;
    cp::find_taut_links(sim.state(), taut_links);
    motion.write_step(before, sim.input(), h, report.softening, taut_links);
  }
  motion.write_end(sim.state());
  std::cout << steps << " steps of " << h << " s; the pelvis ends at z = " << sim.state().q[2]
            << " m\n";

  // Each fall starts 2 cm higher than the one before. A task writes to its own result only.
  std::vector<double> heights(16);
  cp::Batch batch(scene);
  batch.run(static_cast<int>(heights.size()), [&](int i, cp::Simulator& one) {
    cp::State start{0.0, scene.q, scene.v};
    start.q[2] += 0.02 * i;
    one.set_state(start);
    for (int k = 0; k < 200 && one.step().succeeded(); ++k) continue;
    heights[static_cast<std::size_t>(i)] = one.state().q[2];
  });
  const auto [lowest, highest] = std::ranges::minmax(heights);
  std::cout << heights.size() << " falls of 0.4 s: pelvis at z = " << lowest << " ... " << highest
            << " m\n";
}
