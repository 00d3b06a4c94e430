#include "counterpoint/engine/derivatives/forces/body_forces.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

Vector3 direction(const Vector3& v) {
  const double size = v.norm();
  return size > 0.0 ? Vector3(v / size) : Vector3(Vector3::Zero());
}

/// Returns the force -(c1 + c2 |v|) v+ at the centre of a link and the torque of the same form,
/// with derivatives; V, V_next are velocities there (drag.h).
PairResponse drag_response(const Drag& drag, const Motion& V, const Motion& V_next) {
  const double mass = drag.linear + drag.quadratic * V.linear.norm();
  const double about = drag.angular + drag.angular_quadratic * V.angular.norm();
  PairResponse out = body_force({-about * V_next.angular, -mass * V_next.linear});
  out.next.topLeftCorner<3, 3>() = -about * Matrix3::Identity();
  out.next.bottomRightCorner<3, 3>() = -mass * Matrix3::Identity();
  const Matrix3 by_v = -drag.quadratic * V_next.linear * direction(V.linear).transpose();
  out.v_b.bottomRightCorner<3, 3>() = by_v;
  out.v_b.topLeftCorner<3, 3>() =
      -drag.angular_quadratic * V_next.angular * direction(V.angular).transpose();
  // A displaced point has other velocities.
  out.still.bottomRightCorner<3, 3>() = -mass * skew(V_next.angular) + by_v * skew(V.angular);
  out.by_v = drag.quadratic > 0.0 || drag.angular_quadratic > 0.0;
  return out;
}

/// Adds the drag of one link at its centre of mass. at_once: V_next is the velocity at the start.
void add_link(const Model& model, const BodyDrag& link, const Motion& V_next, bool at_once,
              const Kinematics& data, ForceResponses& out) {
  const Vector3 arm = data.X_WB[link.body].rotation * link.center;
  const Motion V = shift(data.V[link.body], arm), next = shift(V_next, arm);
  PairResponse drag = drag_response(link.drag, V, next);
  if (at_once) {
    drag.v_b += drag.next;
    drag.next.setZero();
    drag.by_v = true;
  }
  out.add_body_force(model, link.body, data.X_WB[link.body].translation + arm, drag, next, V, data);
}

}  // namespace

void add_wrench_responses(const Model& model, const std::vector<ExternalWrench>& wrenches,
                          const Kinematics& data, ForceResponses& out) {
  for (const ExternalWrench& w : wrenches) {
    if (w.body == 0) continue;
    out.add_body_force(model, w.body, data.X_WB[w.body] * w.point, body_force(w.wrench), Motion(),
                       Motion(), data);
  }
}

void add_drag_responses(const Model& model, const std::vector<Motion>& V_next,
                        const Kinematics& data, ForceResponses& out) {
  for (const BodyDrag& link : model.drags())
    add_link(model, link, V_next[link.body], false, data, out);
}

void add_drag_responses(const Model& model, const Kinematics& data, ForceResponses& out) {
  for (const BodyDrag& link : model.drags())
    add_link(model, link, data.V[link.body], true, data, out);
}

void add_loss_responses(const Model& model, double h, std::span<const TautLink> links,
                        const Kinematics& data, ForceResponses& out) {
  for (const TautLink& link : links) {
    if (link.kept == link.factor) continue;
    const Matrix3& R_WB = data.X_WB[link.body].rotation;
    const Matrix3 lost = ((1.0 - link.kept / link.factor) / h) *
                         (R_WB * model.body(link.body).inertia.rotational * R_WB.transpose());
    const Motion& V = data.V[link.body];
    PairResponse loss = body_force({-lost * V.angular, Vector3::Zero()});
    loss.v_b.topLeftCorner<3, 3>() = -lost;
    loss.still.topLeftCorner<3, 3>() = skew(lost * V.angular) - lost * skew(V.angular);
    loss.by_v = true;
    out.add_body_force(model, link.body, data.X_WB[link.body].translation, loss, V, V, data);
  }
}

}  // namespace counterpoint
