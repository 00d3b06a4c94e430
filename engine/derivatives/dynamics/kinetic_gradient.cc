#include "counterpoint/engine/derivatives/dynamics/kinetic_gradient.h"

#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

KineticGradient::KineticGradient(const Model& model)
    : dv(VectorX::Zero(model.nv())),
      dq(VectorX::Zero(model.nv())),
      momentum_dv(MatrixX::Zero(3, model.nv())),
      momentum_dq(MatrixX::Zero(3, model.nv())),
      bodies_(model.num_bodies()),
      S_(model.nv()),
      P_(model.nv()) {}

void KineticGradient::compute(const Model& model, const Tree& tree, const Kinematics& data,
                              const double* x, const VectorX& rotors) {
  const Vector3& reference = TreeSweep::reference(tree, data);
  floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
  mass = 0.0;
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const counterpoint::Body& body = model.body(i);
    const Vector3 origin = data.X_WB[i].translation - reference;
    Motion V = body.parent != 0 ? bodies_[body.parent].V : Motion();
    const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
    for (const auto& [begin, end] : {std::pair(0, linear), std::pair(linear, nv)}) {
      Motion across;
      for (int k = body.v_index + begin; k < body.v_index + end; ++k) {
        const Motion& axis = data.axis[k];
        S_[k] = {axis.angular, axis.linear + origin.cross(axis.angular)};
        P_[k] = cross(V, S_[k]);
        across += S_[k] * x[k];
      }
      V += across;
    }
    Body& out = bodies_[i];
    out.V = V;
    out.I = RigidInertia::about_origin(data.inertia[i]);
    out.I.move(origin);
    out.momentum = out.I * V;
    mass += out.I.mass;
  }
  for (int i = tree.body_end - 1; i >= tree.body_begin; --i) {
    const counterpoint::Body& body = model.body(i);
    const Body& whole = bodies_[i];
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
      const int column = k - tree.v_begin;
      dv[column] = dot(S_[k], whole.momentum) + rotors[k] * x[k];
      dq[column] = dot(P_[k], whole.momentum);
      momentum_dv.col(column) = (whole.I * S_[k]).force;
      momentum_dq.col(column) = S_[k].angular.cross(whole.momentum.force) + (whole.I * P_[k]).force;
    }
    if (body.parent == 0) continue;
    bodies_[body.parent].I += whole.I;
    bodies_[body.parent].momentum += whole.momentum;
  }
  if (!floats) return;
  const int size = tree.v_end - tree.v_begin;
  const Vector3 drift = bodies_[tree.body_begin].momentum.force / mass;
  dv.head(size).noalias() -= momentum_dv.leftCols(size).transpose() * drift;
  dq.head(size).noalias() -= momentum_dq.leftCols(size).transpose() * drift;
}

}  // namespace counterpoint
