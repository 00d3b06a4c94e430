#include "counterpoint/engine/forces/free_flight.h"

#include <algorithm>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

EulerTop top_on_joint(const Body& body) {
  return EulerTop(inertia_tensor(inertial_parameters(body.inertia)));
}

}  // namespace

FreeFlight::FreeFlight(const Model& model) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.parent != 0 || body.subtree_end != i + 1 || model.joint(i - 1).prescribed) continue;
    if (body.joint_type == JointType::kFloating) {
      flyers_.push_back(
          {i, EulerTop(body.inertia.rotational), Vector3::Zero(), body.inertia.rotational});
    } else if (body.joint_type == JointType::kSpherical) {
      flyers_.push_back({i, top_on_joint(body), carried_moment(model, i), body.inertia.rotational});
    }
  }
}

Force FreeFlight::mean_force(const Model& model, int index, double h, const Vector3& omega,
                             const Vector3& gravity) const {
  const Flyer& flyer = flyers_[static_cast<size_t>(index)];
  const Body& body = model.body(flyer.body);
  const bool floating = body.joint_type == JointType::kFloating;
  const Vector3& center = body.inertia.center;
  Vector3 turned;
  if (floating || (center.isZero(0.0) && flyer.carried.isZero(0.0))) {
    turned = flyer.top.advance(omega, h);  // independent of a factor on the inertia
  } else {
    // TautLinks scales the inertia of taut links (taut_links.h).
    const bool own = body.inertia.rotational == flyer.rotational;
    const EulerTop top = own ? flyer.top : top_on_joint(body);
    const Vector3 weight = body.inertia.mass * gravity;
    const Vector3 moment = center.cross(weight) - flyer.carried.cross(gravity);
    const Vector3 kick = top.response(h * moment);
    turned = top.advance(top.advance(omega, 0.5 * h) + kick, 0.5 * h) - kick;
  }
  const Vector3 acceleration = (turned - omega) / h;
  Vector3 of_center = acceleration.cross(center);  // if the origin does not move
  if (floating) {
    // v + omega x center, as a vector in W, is conserved; the body turns by h turned.
    const Vector3 after = quaternion_exp(h * turned) * turned.cross(center);
    of_center += (omega.cross(center) - after) / h;
  }
  const Vector3 force = body.inertia.mass * of_center;
  const Vector3 torque = body.inertia.rotational * acceleration + center.cross(force);
  return {-torque, -force};
}

void FreeFlight::apply(const Model& model, double h, const VectorRef& v, const Vector3& gravity,
                       BodyRange bodies, const Kinematics& at, VelocityForces& forces) const {
  const auto before = [](const Flyer& flyer, int body) { return flyer.body < body; };
  auto flyer = std::lower_bound(flyers_.begin(), flyers_.end(), bodies.begin, before);
  for (; flyer != flyers_.end() && flyer->body < bodies.end; ++flyer) {
    const int i = flyer->body;
    const Body& body = model.body(i);
    const Vector3 omega = v.segment<3>(body.v_index + joint_num_linear(body.joint_type));
    const Matrix3& R_WB = at.X_WB[i].rotation;
    const Force force = mean_force(model, static_cast<int>(flyer - flyers_.begin()), h, omega,
                                   R_WB.transpose() * gravity);
    forces.has_mean_force[i] = 1;
    forces.mean_force[i] = {R_WB * force.torque, R_WB * force.force};
  }
}

}  // namespace counterpoint
