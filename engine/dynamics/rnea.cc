#include "counterpoint/engine/dynamics/rnea.h"

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, const BodyState& bodies,
          VectorOut tau) {
  const auto& [at, velocity, external, scratch] = bodies;
  std::vector<Motion>& A = scratch.A;
  std::vector<Force>& F = scratch.F;
  // Gravity enters as an upward acceleration of the world.
  A[0] = {Vector3::Zero(), -gravity};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    A[i] = shift(A[body.parent], at.arm[i]) + velocity_product(at, velocity, i) +
           joint_motion(body.joint_type, &at.axis[body.v_index], a.data() + body.v_index);
    const Matrix3& R_WB = at.X_WB[i].rotation;
    F[i] = velocity.is_instantaneous(i) ? rigid_body_force(body.inertia, R_WB, at.V[i], A[i])
                                        : rigid_body_force(body.inertia, R_WB, A[i]);
    if (velocity.has_coriolis && velocity.has_mean_force[i]) F[i] += velocity.mean_force[i];
    if (external.has_external) F[i] -= external.external[i];
  }
  subtract_carried_weight(model, gravity, moving_bodies(model), at, F);
  tau.setZero();
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const Body& body = model.body(i);
    add_joint_force(body.joint_type, &at.axis[body.v_index], F[i], tau.data() + body.v_index);
    if (body.parent != 0) F[body.parent] += shift(F[i], at.arm[i]);
  }
}

}  // namespace counterpoint
