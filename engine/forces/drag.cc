#include "counterpoint/engine/forces/drag.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

void compute_drag(const Model& model, double h, Data& data) {
  data.added.resize(model.drags().size());
  for (size_t i = 0; i < data.added.size(); ++i) {
    const BodyDrag& link = model.drags()[i];
    const Drag& drag = link.drag;
    const Motion& V = data.V[link.body];
    SpatialInertia hC;
    hC.center = data.X_WB[link.body].rotation * link.center;
    hC.mass = h * (drag.linear + drag.quadratic * V.at(hC.center).norm());
    const double about = h * (drag.angular + drag.angular_quadratic * V.angular.norm());
    hC.rotational = about * Matrix3::Identity();
    data.added[i] = {link.body, hC};
  }
}

void add_drag(const Model& model, double h, const Vector3& gravity,
              std::vector<Motion>& acceleration, Data& data) {
  compute_velocity_accelerations(model, data, acceleration);
  for (const AddedInertia& hC : data.added) {
    Motion known = acceleration[hC.body] - data.V[hC.body] * (1.0 / h);
    known.linear -= gravity;
    data.external[hC.body] += hC.inertia * known;
  }
}

void add_drag_inverse(double h, const std::vector<Motion>& V_next, Data& data) {
  for (const AddedInertia& hC : data.added)
    data.external[hC.body] -= hC.inertia * V_next[hC.body] * (1.0 / h);
}

}  // namespace counterpoint
