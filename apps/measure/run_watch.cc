#include "run_watch.h"

#include <algorithm>

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/springs.h"

namespace counterpoint::apps {

RunWatch::RunWatch(Simulator& simulator)
    : simulator_(simulator), data_(simulator.model()), v_(simulator.state().v) {
  start_ = energy();
}

double RunWatch::energy() {
  const Model& model = simulator_.model();
  const State& state = simulator_.state();
  compute_poses(model, state.q, data_);
  compute_velocities(model, state.v, data_);
  compute_inertias(model, data_);
  return kinetic_energy(model, state.v, data_) + potential_energy(model, data_) +
         spring_energy(model, state.q);
}

void RunWatch::after_step(double h) {
  const VectorX& v = simulator_.state().v;
  // What a constant force adds to the kinetic energy of a step is its power at the mean velocity.
  work_ += 0.5 * h * simulator_.input().applied_force.dot(v_ + v);
  v_ = v;
  gain_ = std::max(gain_, energy() - start_ - work_);
}

double RunWatch::below_ground() const {
  const Model& model = simulator_.model();
  double most = 0.0;
  for (const Geometry& plane : model.geometries()) {
    if (plane.shape.type != ShapeType::kPlane || plane.body != 0) continue;
    const Pose X_PW = plane.X_BG.inverse();
    for (const Geometry& g : model.geometries()) {
      if (g.body == 0) continue;
      const Pose X_WG = data_.X_WB[static_cast<std::size_t>(g.body)] * g.X_BG;
      most = std::max(most, -lowest_point(g.shape, X_PW * X_WG));
    }
  }
  return most;
}

void RunWatch::fill(Json& out) const {
  // Servos and wrenches on links do work that is not counted.
  const bool known = simulator_.model().servos().empty() && simulator_.input().wrenches.empty();
  out["input_work_J"] = known ? Json(work_) : Json(nullptr);
  out["energy_gain_max_J"] = known ? Json(gain_) : Json(nullptr);
  out["end_below_ground_m"] = below_ground();
}

}  // namespace counterpoint::apps
