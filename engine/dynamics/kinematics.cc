#include "counterpoint/engine/dynamics/kinematics.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/lanes/wide.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/sin_cos.h"

namespace counterpoint {

Kinematics::Kinematics(const Model& model)
    : sine(model.num_bodies()),
      cosine(model.num_bodies()),
      X_WB(model.num_bodies()),
      arm(model.num_bodies(), Vector3::Zero()),
      axis(model.nv()),
      V(model.num_bodies()),
      c(model.num_bodies()),
      inertia(model.num_bodies()) {}

VelocityForces::VelocityForces(const Model& model)
    : has_mean_force(model.num_bodies(), 0),
      mean_force(model.num_bodies()),
      mean_rotor_force(VectorX::Zero(model.nv())) {}

DynamicsScratch::DynamicsScratch(const Model& model)
    : A(model.num_bodies()),
      F(model.num_bodies()),
      IA(model.num_bodies()),
      pA(model.num_bodies()),
      U(model.num_bodies()),
      D_inv(model.num_bodies()),
      u(model.num_bodies()),
      multi(model.num_bodies()),
      composite(model.num_bodies()) {}

namespace {

COUNTERPOINT_WIDE void sines_and_cosines(const double* angle, int count, double* __restrict sine,
                                         double* __restrict cosine) {
  for (int i = 0; i < count; ++i) sin_cos_reduced(angle[i], sine[i], cosine[i]);
}

/// Computes sines and cosines of all revolute joint angles in blocks.
void compute_turns(const Model& model, const VectorRef& q, BodyRange bodies, Kinematics& at) {
  constexpr int kBlock = 64;
  double angle[kBlock];
  for (int begin = bodies.begin; begin < bodies.end; begin += kBlock) {
    const int count = std::min(kBlock, bodies.end - begin);
    bool any = false, ordinary = true;
    for (int i = 0; i < count; ++i) {
      const Body& body = model.body(begin + i);
      const bool turns = body.joint_type == JointType::kRevolute;
      angle[i] = turns ? q[body.q_index] : 0.0;
      any |= turns;
      ordinary &= std::abs(angle[i]) <= kMaxReducedAngle;
    }
    if (!any) continue;
    sines_and_cosines(angle, count, &at.sine[begin], &at.cosine[begin]);
    if (ordinary) continue;
    for (int i = 0; i < count; ++i) sin_cos(angle[i], at.sine[begin + i], at.cosine[begin + i]);
  }
}

}  // namespace

void compute_poses(const Model& model, const VectorRef& q, BodyRange bodies, Kinematics& at) {
  compute_turns(model, q, bodies, at);
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const Body& body = model.body(i);
    const Pose& X_WP = at.X_WB[body.parent];
    Pose& X_WB = at.X_WB[i];
    if (body.joint_type == JointType::kRevolute) {
      // The joint rotation is composed with X_PJ first, which does not wait for the parent's pose.
      const Matrix3& R_PJ = body.X_PJ.rotation;
      const double s = at.sine[i], c = at.cosine[i];
      Matrix3 R_PB;
      R_PB.col(0) = c * R_PJ.col(0) + s * R_PJ.col(1);
      R_PB.col(1) = c * R_PJ.col(1) - s * R_PJ.col(0);
      R_PB.col(2) = R_PJ.col(2);
      X_WB.rotation.noalias() = X_WP.rotation * R_PB;
      at.arm[i].noalias() = X_WP.rotation * body.X_PJ.translation;
      X_WB.translation = X_WP.translation + at.arm[i];
      at.axis[body.v_index] = {X_WB.rotation.col(2), Vector3::Zero()};
      continue;
    }
    const Pose X_WJ = body.parent == 0 ? body.X_PJ : X_WP * body.X_PJ;
    X_WB = joint_pose(X_WJ, body.joint_type, q.data() + body.q_index);
    at.arm[i] = X_WB.translation - X_WP.translation;
    joint_axes(body.joint_type, X_WJ.rotation, X_WB.rotation, &at.axis[body.v_index]);
  }
}

void compute_velocities(const Model& model, const VectorRef& v, BodyRange bodies, Kinematics& at) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const Body& body = model.body(i);
    const Motion V_J =
        joint_motion(body.joint_type, &at.axis[body.v_index], v.data() + body.v_index);
    // Kept in local variables: reading back a value just stored would stall.
    Motion V = V_J, c;
    if (body.parent != 0) {
      V += shift(at.V[body.parent], at.arm[i]);
      c = cross(V, V_J);
    }
    if (joint_axes_turn(body.joint_type)) c.linear -= V_J.angular.cross(V_J.linear);
    at.V[i] = V;
    at.c[i] = c;
  }
}

void compute_body_velocities(const Model& model, const VectorRef& v, BodyRange bodies,
                             const Kinematics& at, std::vector<Motion>& V) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const Body& body = model.body(i);
    Motion of_body = joint_motion(body.joint_type, &at.axis[body.v_index], v.data() + body.v_index);
    if (body.parent != 0) of_body += shift(V[body.parent], at.arm[i]);
    V[i] = of_body;
  }
}

void compute_body_velocities(const Model& model, const VectorRef& v, const Kinematics& at,
                             std::vector<Motion>& V) {
  compute_body_velocities(model, v, moving_bodies(model), at, V);
}

void compute_velocity_accelerations(const Model& model, const Kinematics& at,
                                    std::vector<Motion>& A) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    A[i] = at.c[i];
    if (model.body(i).parent != 0) A[i] += shift(A[model.body(i).parent], at.arm[i]);
  }
}

void compute_velocity_accelerations(const Model& model, const Kinematics& at,
                                    const VelocityForces& velocity, std::vector<Motion>& A) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    A[i] = velocity_product(at, velocity, i);
    if (model.body(i).parent != 0) A[i] += shift(A[model.body(i).parent], at.arm[i]);
  }
}

void compute_inertias(const Model& model, BodyRange bodies, Kinematics& at) {
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const Matrix3& R = at.X_WB[i].rotation;
    at.inertia[i].mass = inertia.mass;
    at.inertia[i].center.noalias() = R * inertia.center;
    const Matrix3 turned = R * inertia.rotational;
    Matrix3& out = at.inertia[i].rotational;
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k <= j; ++k) out(j, k) = out(k, j) = turned.row(j).dot(R.row(k));
  }
}

}  // namespace counterpoint
