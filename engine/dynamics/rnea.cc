#include "counterpoint/engine/dynamics/rnea.h"

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
Force rigid_body_force(const SpatialInertia& inertia, const Matrix3& R_WB, const Motion& V,
                       const Motion& A) {
  const Vector3 center = R_WB * inertia.center;
  // Newton: classical acceleration of the centre of mass; Euler about it.
  const Vector3 acceleration = A.at(center) + V.angular.cross(V.at(center));
  const Vector3 omega_B = R_WB.transpose() * V.angular;
  const Vector3 torque_B = inertia.rotational * (R_WB.transpose() * A.angular) +
                           omega_B.cross(inertia.rotational * omega_B);
  const Vector3 force = inertia.mass * acceleration;
  return {R_WB * torque_B + center.cross(force), force};
}

void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, Data& data,
          VectorOut tau) {
  // Gravity enters as an acceleration of the world upwards.
  data.A[0] = {Vector3::Zero(), -gravity};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    data.A[i] = shift(data.A[body.parent], data.arm[i]) + data.c[i] +
                joint_motion(body.joint_type, &data.axis[body.v_index], a.data() + body.v_index);
    const bool flies = data.has_coriolis && data.has_mean_force[i];
    data.F[i] = rigid_body_force(body.inertia, data.X_WB[i].rotation,
                                 data.has_coriolis && !flies ? data.V[i] : Motion(), data.A[i]);
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
