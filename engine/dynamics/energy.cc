#include "counterpoint/engine/dynamics/energy.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

double total_mass(const Model& model) {
  double mass = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i) mass += model.body(i).inertia.mass;
  return mass;
}

double kinetic_energy(const Model& model, const VectorRef& v, const Kinematics& data) {
  double energy = 0.5 * v.dot(model.armature().cwiseProduct(v));
  for (int i = 1; i < model.num_bodies(); ++i)
    energy += 0.5 * dot(data.V[i], data.inertia[i] * data.V[i]);
  return energy;
}

double potential_energy(const Model& model, const Kinematics& data) {
  double energy = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    energy -= inertia.mass * model.gravity().dot(data.X_WB[i] * inertia.center);
  }
  for (const GravityCompensation& carried : model.gravity_compensations())
    energy += carried.mass * model.gravity().dot(data.X_WB[carried.body] * carried.center);
  return energy;
}

Force total_momentum(const Model& model, const Kinematics& data) {
  Force momentum;
  for (int i = 1; i < model.num_bodies(); ++i)
    momentum += shift(data.inertia[i] * data.V[i], data.X_WB[i].translation);
  return momentum;
}

}  // namespace counterpoint
