#include "total_energy.h"

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/springs.h"

namespace counterpoint::apps {

double total_energy(const Model& model, const State& state) {
  Data data(model);
  compute_poses(model, state.q, data);
  compute_velocities(model, state.v, data);
  compute_inertias(model, data);
  return kinetic_energy(model, state.v, data) + potential_energy(model, data) +
         spring_energy(model, state.q);
}

}  // namespace counterpoint::apps
