#include "counterpoint/engine/rnea.h"

#include "counterpoint/engine/joint_motion.h"

namespace counterpoint {

void rnea(const Model& model, const VectorRef& a, Data& data, VectorOut tau) {
  // Gravity enters as an acceleration of the world upwards.
  data.A[0] = {Vector3::Zero(), -model.gravity()};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const Matrix3 R_JB =
        joint_axes_turn(body.joint_type) ? joint_rotation(body.X_PJ, data.X_PB[i]) : Matrix3();
    data.A[i] = data.X_PB[i].inverse_apply(data.A[body.parent]) +
                joint_motion(body.joint_type, R_JB, a.data() + body.v_index) + data.c[i];
    const Motion& V = data.V[i];
    data.F[i] = body.inertia * data.A[i] + cross(V, body.inertia * V);
    if (data.has_external) data.F[i] -= data.external[i];
  }
  tau = model.armature().cwiseProduct(a);
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const Body& body = model.body(i);
    const Matrix3 R_JB =
        joint_axes_turn(body.joint_type) ? joint_rotation(body.X_PJ, data.X_PB[i]) : Matrix3();
    add_joint_force(body.joint_type, R_JB, data.F[i], tau.data() + body.v_index);
    if (body.parent != 0) data.F[body.parent] += data.X_PB[i] * data.F[i];
  }
}

}  // namespace counterpoint
