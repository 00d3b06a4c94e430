#include "counterpoint/engine/kinematics.h"

#include "counterpoint/engine/joint_motion.h"

namespace counterpoint {

Data::Data(const Model& model)
    : X_PB(model.num_bodies()),
      X_WB(model.num_bodies()),
      V(model.num_bodies()),
      V_J(model.num_bodies()),
      c(model.num_bodies()),
      external(model.num_bodies()),
      A(model.num_bodies()),
      F(model.num_bodies()),
      IA(model.num_bodies()),
      pA(model.num_bodies()),
      U(model.num_bodies()),
      D_inv(model.num_bodies()),
      u(model.num_bodies()),
      multi(model.num_bodies()),
      composite(model.num_bodies()) {}

void compute_poses(const Model& model, const VectorRef& q, Data& data) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    data.X_PB[i] = joint_pose(body.X_PJ, body.joint_type, q.data() + body.q_index);
    data.X_WB[i] = body.parent == 0 ? data.X_PB[i] : data.X_WB[body.parent] * data.X_PB[i];
  }
}

void compute_velocities(const Model& model, const VectorRef& v, Data& data) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const bool turns = joint_axes_turn(body.joint_type);
    const Matrix3 R_JB = turns ? joint_rotation(body.X_PJ, data.X_PB[i]) : Matrix3();
    const Motion V_J = joint_motion(body.joint_type, R_JB, v.data() + body.v_index);
    data.V_J[i] = V_J;
    if (body.parent == 0) {
      data.V[i] = V_J;
      data.c[i] = Motion();
    } else {
      data.V[i] = data.X_PB[i].inverse_apply(data.V[body.parent]) + V_J;
      data.c[i] = cross(data.V[i], V_J);
    }
    if (turns) data.c[i].linear -= V_J.angular.cross(V_J.linear);
  }
}

void compute_body_velocities(const Model& model, const VectorRef& v, const Data& data,
                             std::vector<Motion>& V) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const Matrix3 R_JB =
        joint_axes_turn(body.joint_type) ? joint_rotation(body.X_PJ, data.X_PB[i]) : Matrix3();
    V[i] = joint_motion(body.joint_type, R_JB, v.data() + body.v_index);
    if (body.parent != 0) V[i] += data.X_PB[i].inverse_apply(V[body.parent]);
  }
}

Vector3 point_jacobian_column(const Model& model, const Data& data, int body, int j,
                              const Vector3& p_W) {
  const Body& b = model.body(body);
  const Pose& X_WB = data.X_WB[body];
  const Matrix3 R_JB = joint_axes_turn(b.joint_type) ? joint_rotation(b.X_PJ, data.X_PB[body]) : Matrix3();
  const Motion axis = joint_axis(b.joint_type, R_JB, j);
  return X_WB.rotation * axis.linear +
         (X_WB.rotation * axis.angular).cross(p_W - X_WB.translation);
}

}  // namespace counterpoint
