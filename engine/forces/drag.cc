#include "counterpoint/engine/forces/drag.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

void compute_drag(const Model& model, double h, const Kinematics& at, ExternalForces& external) {
  external.added.resize(model.drags().size());
  for (size_t i = 0; i < external.added.size(); ++i) {
    const BodyDrag& link = model.drags()[i];
    const Drag& drag = link.drag;
    const Motion& V = at.V[link.body];
    SpatialInertia hC;
    hC.center = at.X_WB[link.body].rotation * link.center;
    hC.mass = h * (drag.linear + drag.quadratic * V.at(hC.center).norm());
    const double about = h * (drag.angular + drag.angular_quadratic * V.angular.norm());
    hC.rotational = about * Matrix3::Identity();
    external.added[i] = {link.body, hC};
  }
}

void add_drag(const Model& model, double h, const Vector3& gravity, const Kinematics& at,
              const VelocityForces& velocity, std::vector<Motion>& acceleration,
              ExternalForces& external) {
  compute_velocity_accelerations(model, at, velocity, acceleration);
  for (const AddedInertia& hC : external.added) {
    Motion known = acceleration[hC.body] - at.V[hC.body] * (1.0 / h);
    known.linear -= gravity;
    external.external[hC.body] += hC.inertia * known;
  }
}

void add_drag_inverse(double h, const std::vector<Motion>& V_next, ExternalForces& external) {
  for (const AddedInertia& hC : external.added)
    external.external[hC.body] -= hC.inertia * V_next[hC.body] * (1.0 / h);
}

}  // namespace counterpoint
