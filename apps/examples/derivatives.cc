// Differentiates the recovered forces of a falling cube by its configuration, du/dq, in closed form
// and by differences: in free flight and while the ground stops it.
#include <counterpoint/engine/engine.h>

#include <algorithm>
#include <iostream>
#include <string>

namespace cp = counterpoint;

/// Prints the largest entry of du/dq of the step from `before` to `after`, by both methods.
void differentiate(const char* name, const cp::Simulator& sim, const cp::State& before,
                   const cp::State& after) {
  const cp::Model& model = sim.model();
  cp::Workspace workspace(model);
  cp::Inverse forces;
  cp::InverseDerivatives exact, differences;
  cp::step_inverse_derivatives(model, sim.scene().options, before.q, before.v, after.v, {},
                               workspace, forces, exact);
  cp::step_inverse_derivatives(model, sim.scene().options, before.q, before.v, after.v, {},
                               workspace, forces, differences, cp::DerivativeMethod::kExtrapolated);
  const double largest = exact.dq.cwiseAbs().maxCoeff();
  const double off = (exact.dq - differences.dq).cwiseAbs().maxCoeff();
  std::cout << name << " (contacts: " << forces.contacts.size() << "): du/dq up to " << largest
            << " N/m; differences agree to " << off / std::max(largest, 1.0) << " of it\n";
}

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  cp::Simulator sim(cp::load_scene(data + "/scenes/cube_drop.yaml"));
  cp::State before = sim.state();
  sim.step();
  differentiate("in flight", sim, before, sim.state());

  bool pushes = false;  // the ground exerts a force
  while (!pushes) {
    before = sim.state();
    if (!sim.step().succeeded()) return 1;
    for (const cp::ContactForce& contact : sim.last_forces().contacts)
      pushes = pushes || contact.force.norm() > 1.0;  // [N]
  }
  differentiate("at the impact", sim, before, sim.state());
}
