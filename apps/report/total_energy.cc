#include "total_energy.h"

#include <algorithm>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::apps {

SurfaceSprings::SurfaceSprings(const Model& model) : model_(model) {
  const auto is_soft = [](const auto& part) { return part.material.is_soft(); };
  if (!std::any_of(model.geometries().begin(), model.geometries().end(), is_soft) &&
      !std::any_of(model.pair_materials().begin(), model.pair_materials().end(), is_soft))
    return;
  collider_.emplace(model);
  margin_.resize(static_cast<std::size_t>(model.num_bodies()), 0.0);
}

double SurfaceSprings::energy(const VectorX& q) {
  double energy = 0.0;
  if (!collider_) return energy;
  collider_->compute_candidates(body_poses(model_, q), margin_, candidates_);
  for (const collision::Candidate& c : candidates_) {
    const Material pair = model_.pair_material(c.geometry_a, c.geometry_b);
    if (!pair.is_soft() || !(c.gap < 0.0)) continue;
    energy += 0.5 * pair.spring_of(c.area).stiffness * c.gap * c.gap;
  }
  return energy;
}

bool has_drives(const Model& model) {
  const auto moves = [](const Geometry& g) { return !g.material.surface_velocity.isZero(0.0); };
  const auto pulls = [](const Tendon& t) { return t.servo.any(); };
  const auto driven = [](const JointInfo& joint) { return joint.prescribed; };
  return !model.servos().empty() || !model.actuators().empty() ||
         std::any_of(model.joints().begin(), model.joints().end(), driven) ||
         std::any_of(model.geometries().begin(), model.geometries().end(), moves) ||
         std::any_of(model.tendons().begin(), model.tendons().end(), pulls);
}

double total_energy(const Model& model, const State& state) {
  Dynamics dynamics(model);
  dynamics.set_state(state.q, state.v);
  return dynamics.kinetic_energy() + dynamics.potential_energy() +
         spring_energy(model, state.q, state.z) + SurfaceSprings(model).energy(state.q);
}

}  // namespace counterpoint::apps
