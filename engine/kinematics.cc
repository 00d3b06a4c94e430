#include "counterpoint/engine/kinematics.h"

#include "counterpoint/engine/joint_motion.h"

namespace counterpoint {

Data::Data(const Model& model)
    : X_WB(model.num_bodies()),
      arm(model.num_bodies(), Vector3::Zero()),
      axis(model.nv()),
      V(model.num_bodies()),
      c(model.num_bodies()),
      inertia(model.num_bodies()),
      external(model.num_bodies()),
      has_mean_force(model.num_bodies(), 0),
      mean_force(model.num_bodies()),
      mean_rotor_force(VectorX::Zero(model.nv())),
      A(model.num_bodies()),
      F(model.num_bodies()),
      IA(model.num_bodies()),
      pA(model.num_bodies()),
      U(model.num_bodies()),
      D_inv(model.num_bodies()),
      u(model.num_bodies()),
      multi(model.num_bodies()),
      composite(model.num_bodies()) {}

void compute_poses(const Model& model, const VectorRef& q, BodyRange bodies, Data& data) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const Body& body = model.body(i);
    const Pose X_WJ = body.parent == 0 ? body.X_PJ : data.X_WB[body.parent] * body.X_PJ;
    data.X_WB[i] = joint_pose(X_WJ, body.joint_type, q.data() + body.q_index);
    data.arm[i] = data.X_WB[i].translation - data.X_WB[body.parent].translation;
    joint_axes(body.joint_type, X_WJ.rotation, data.X_WB[i].rotation, &data.axis[body.v_index]);
  }
}

void compute_velocities(const Model& model, const VectorRef& v, BodyRange bodies, Data& data) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const Body& body = model.body(i);
    const Motion V_J =
        joint_motion(body.joint_type, &data.axis[body.v_index], v.data() + body.v_index);
    if (body.parent == 0) {
      data.V[i] = V_J;
      data.c[i] = Motion();
    } else {
      data.V[i] = shift(data.V[body.parent], data.arm[i]) + V_J;
      data.c[i] = cross(data.V[i], V_J);
    }
    if (joint_axes_turn(body.joint_type)) data.c[i].linear -= V_J.angular.cross(V_J.linear);
  }
}

void compute_body_velocities(const Model& model, const VectorRef& v, const Data& data,
                             std::vector<Motion>& V) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    V[i] = joint_motion(body.joint_type, &data.axis[body.v_index], v.data() + body.v_index);
    if (body.parent != 0) V[i] += shift(V[body.parent], data.arm[i]);
  }
}

void compute_velocity_accelerations(const Model& model, const Data& data, std::vector<Motion>& A) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    A[i] = data.c[i];
    if (model.body(i).parent != 0) A[i] += shift(A[model.body(i).parent], data.arm[i]);
  }
}

void compute_inertias(const Model& model, BodyRange bodies, Data& data) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const Matrix3& R = data.X_WB[i].rotation;
    data.inertia[i].mass = inertia.mass;
    data.inertia[i].center.noalias() = R * inertia.center;
    data.inertia[i].rotational.noalias() = R * inertia.rotational * R.transpose();
  }
}

}  // namespace counterpoint
