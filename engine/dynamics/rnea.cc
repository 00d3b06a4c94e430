#include "counterpoint/engine/dynamics/rnea.h"

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, Data& data,
          VectorOut tau) {
  // Gravity enters as an upward acceleration of the world.
  data.A[0] = {Vector3::Zero(), -gravity};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    data.A[i] = shift(data.A[body.parent], data.arm[i]) + data.c[i] +
                joint_motion(body.joint_type, &data.axis[body.v_index], a.data() + body.v_index);
    const bool flies = data.has_coriolis && data.has_mean_force[i];
    const Matrix3& R_WB = data.X_WB[i].rotation;
    data.F[i] = data.has_coriolis && !flies
                    ? rigid_body_force(body.inertia, R_WB, data.V[i], data.A[i])
                    : rigid_body_force(body.inertia, R_WB, data.A[i]);
    if (flies) data.F[i] += data.mean_force[i];
    if (data.has_external) data.F[i] -= data.external[i];
  }
  subtract_carried_weight(model, gravity, moving_bodies(model), data, data.F);
  tau.setZero();
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const Body& body = model.body(i);
    add_joint_force(body.joint_type, &data.axis[body.v_index], data.F[i],
                    tau.data() + body.v_index);
    if (body.parent != 0) data.F[body.parent] += shift(data.F[i], data.arm[i]);
  }
}

}  // namespace counterpoint
