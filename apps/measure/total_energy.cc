#include "total_energy.h"

#include <utility>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::apps {

SurfaceSprings::SurfaceSprings(const Model& model)
    : model_(model), margin_(static_cast<std::size_t>(model.num_bodies()), 0.0) {
  const int count = static_cast<int>(model.geometries().size());
  collision::Collider collider(model);
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      if (!model.pair_material(a, b).is_soft() || !collider.may_touch(a, b)) continue;
      collider_ = std::move(collider);
      return;
    }
  }
}

double SurfaceSprings::energy(const VectorX& q) {
  double energy = 0.0;
  if (!collider_) return energy;
  collider_->compute_candidates(body_poses(model_, q), margin_, candidates_);
  for (const collision::Candidate& c : candidates_) {
    const Material pair = model_.pair_material(c.geometry_a, c.geometry_b);
    if (pair.is_soft() && c.gap < 0.0) energy += 0.5 * pair.stiffness * c.gap * c.gap;
  }
  return energy;
}

double total_energy(const Model& model, const State& state) {
  Dynamics dynamics(model);
  dynamics.set_state(state.q, state.v);
  return dynamics.kinetic_energy() + dynamics.potential_energy() + spring_energy(model, state.q) +
         SurfaceSprings(model).energy(state.q);
}

}  // namespace counterpoint::apps
