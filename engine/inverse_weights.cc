#include "counterpoint/engine/inverse_weights.h"

#include <fmt/format.h>

#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/kinematics.h"

namespace counterpoint {
namespace {

/// Response of one tree, at rest in the default pose, to joint forces and external wrenches.
void respond(const Model& model, const Tree& tree, const VectorX& tau, const VectorX& zero,
             Data& data, VectorX& a) {
  int singular = 0;
  if (aba(model, tau, zero, Vector3::Zero(), tree.body_begin, tree.body_end, data, a, &singular))
    return;
  throw InputError(
      fmt::format("joint '{}': the inertia it moves is not positive in the default pose; give its "
                  "link '{}' an inertial element (or the joint an armature)",
                  model.joint(singular - 1).name, model.joint(singular - 1).link));
}

}  // namespace

InverseWeights compute_inverse_weights(const Model& model, Data& data) {
  InverseWeights weights;
  weights.body.assign(model.num_bodies(), 0.0);
  weights.rotational.assign(model.num_bodies(), 0.0);
  weights.dof = VectorX::Zero(model.nv());
  VectorX tau = VectorX::Zero(model.nv()), a = tau;
  const VectorX zero = tau;
  compute_poses(model, model.default_q(), data);
  compute_velocities(model, zero, data);
  compute_inertias(model, data);
  data.has_external = true;
  for (Force& f : data.external) f = Force();
  for (const Tree& tree : model.trees()) {
    for (int b = tree.body_begin; b < tree.body_end; ++b) {
      const Vector3& center = data.inertia[b].center;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3 push = Vector3::Unit(axis);
        data.external[b] = {center.cross(push), push};
        respond(model, tree, tau, zero, data, a);
        weights.body[b] += data.A[b].at(center)[axis] / 3.0;
        data.external[b] = {push, Vector3::Zero()};
        respond(model, tree, tau, zero, data, a);
        weights.rotational[b] += data.A[b].angular[axis] / 3.0;
      }
      data.external[b] = Force();
    }
    for (int j = tree.v_begin; j < tree.v_end; ++j) {
      tau[j] = 1.0;
      respond(model, tree, tau, zero, data, a);
      weights.dof[j] = a[j];
      tau[j] = 0.0;
    }
  }
  data.has_external = false;
  return weights;
}

}  // namespace counterpoint
