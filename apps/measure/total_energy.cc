#include "total_energy.h"

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::apps {

double total_energy(const Model& model, const State& state) {
  Dynamics dynamics(model);
  dynamics.set_state(state.q, state.v);
  return dynamics.kinetic_energy() + dynamics.potential_energy() + spring_energy(model, state.q);
}

}  // namespace counterpoint::apps
