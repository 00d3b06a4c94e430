// Recovers the forces that moved a humanoid from its motion alone.
#include <counterpoint/engine/engine.h>

#include <algorithm>
#include <iostream>
#include <random>
#include <string>

namespace cp = counterpoint;

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  cp::Simulator sim(cp::load_scene(data + "/scenes/humanoid_drop.yaml"));
  const cp::Model& model = sim.model();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> torque(-5.0, 5.0);  // [N m]

  cp::Workspace workspace(model);
  cp::Inverse found;
  double worst = 0.0, scale = 0.0, ground = 0.0;  // [N or N m], [N or N m], [N]
  for (int k = 0; k < 300; ++k) {
    // The first six coordinates are those of the floating base, which has no motor.
    for (int i = 6; i < model.nv(); ++i) sim.input().applied_force[i] = torque(random);
    const cp::State before = sim.state();
    const cp::StepReport report = sim.step();
    if (!report.succeeded()) return 1;

    cp::Input known;  // a trajectory file records these two as well; most steps have none
    known.softening = report.softening;
    cp::find_taut_links(sim.state(), known.taut_links);
    cp::step_inverse(model, sim.options(), before.q, before.v, sim.state().v, known, workspace,
                     found);
    worst = std::max(worst, (found.applied_force - sim.input().applied_force).norm());
    scale = std::max(scale, found.force_scale);
    double push = 0.0;
    for (const cp::ContactForce& contact : found.contacts)  // forces act on geometry B
      if (model.geometries()[contact.contact.geometry_b].name == "ground")
        push -= contact.force.z();
    ground = std::max(ground, push);
  }
  std::cout << "torques recovered to " << worst / scale << " of the largest force, " << scale
            << " N or N m\n";
  std::cout << "the ground pushes with up to " << ground << " N; the humanoid weighs "
            << cp::kStandardGravity * cp::Dynamics(model).total_mass() << " N\n";
}
