#include "counterpoint/engine/sensors/joint_wrenches.h"

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"

namespace counterpoint {
namespace {

/// A wrench that acts at a point of W, moved to the origin of a body.
Force moved_to(const Vector3& origin, const Vector3& point, const Force& wrench) {
  return {wrench.torque + (point - origin).cross(wrench.force), wrench.force};
}

/// Calls push(body, point, wrench) for each end and wrap of each spatial tendon, with the force
/// that acts as tension times the derivative of the length; point and wrench in W.
template <class Push>
void for_each_pull(const Model& model, const Kinematics& at, const Inverse& inverse, Push push) {
  for (std::size_t i = 0; i < model.tendons().size(); ++i) {
    const Tendon& tendon = model.tendons()[i];
    if (!tendon.is_spatial()) continue;
    const double tension = tendon_tension(model, inverse, static_cast<int>(i));
    for (const TendonSegment& segment : tendon.path) {
      const auto [start, end, length] = place_segment(tendon, segment, at.X_WB, false);
      const Vector3 a = tension * segment.share * length.by_a,
                    b = tension * segment.share * length.by_b;
      push(segment.from.body, start, Force{Vector3::Zero(), a});
      push(segment.to.body, end, Force{Vector3::Zero(), b});
      if (segment.wrap < 0) continue;
      const TendonWrap& wrap = tendon.wraps[static_cast<std::size_t>(segment.wrap)];
      const Vector3 center = at.X_WB[static_cast<std::size_t>(wrap.body)] * wrap.X_BG.translation;
      push(wrap.body, center,
           Force{(center - start).cross(a) + (center - end).cross(b), Vector3(-a - b)});
    }
  }
}

}  // namespace

double tendon_tension(const Model& model, const Inverse& inverse, int tendon) {
  double sum = inverse.tendon_force[tendon];
  for (std::size_t i = 0; i < model.actuators().size(); ++i) {
    const Actuator& a = model.actuators()[i];
    if (a.tendon == tendon) sum += a.gear * inverse.actuator_force[static_cast<Eigen::Index>(i)];
  }
  return sum;
}

void JointWrenches::compute(const Model& model, const Kinematics& at,
                            const std::vector<Force>& free, const Inverse& inverse) {
  for (Force& wrench : of_) wrench = {};
  const auto subtract = [&](int body, double sign, const Vector3& point, const Force& wrench) {
    const auto i = static_cast<std::size_t>(body);
    of_[i] -= moved_to(at.X_WB[i].translation, point, wrench) * sign;
  };
  for (const ContactForce& one : inverse.contacts) {
    const Force wrench{one.torque, one.force};
    const Vector3& point = one.contact.position;
    const auto& geometries = model.geometries();
    subtract(geometries[static_cast<std::size_t>(one.contact.geometry_b)].body, 1.0, point, wrench);
    subtract(geometries[static_cast<std::size_t>(one.contact.geometry_a)].body, -1.0, point,
             wrench);
  }
  for (std::size_t i = 0; i < inverse.closures.size(); ++i) {
    const ClosureForce& one = inverse.closures[i];
    subtract(model.closures()[i].body_b, 1.0, one.position, one.force);
    subtract(model.closures()[i].body_a, -1.0, one.position, one.force);
  }
  for_each_pull(model, at, inverse, [&](int body, const Vector3& point, const Force& pull) {
    subtract(body, 1.0, point, pull);
  });
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const auto b = static_cast<std::size_t>(i);
    const auto parent = static_cast<std::size_t>(model.body(i).parent);
    if (parent != 0) of_[parent] += shift(of_[b], at.arm[b]);
    of_[b] += free[b];
  }
}

Force weld_wrench(const Model& model, const CarriedPart& part, const WeldMotion& motion) {
  const auto b = static_cast<std::size_t>(part.body);
  const Pose& X_WB = motion.at.X_WB[b];
  Force out = rigid_body_force(part.share, X_WB.rotation, motion.at.V[b], motion.A);
  const auto has = [&](int geometry) {
    const Geometry& g = model.geometries()[static_cast<std::size_t>(geometry)];
    return g.body == part.body && g.frame >= 0 && part.holds(g.frame);
  };
  for (const ContactForce& one : motion.inverse.contacts)
    out -= moved_to(X_WB.translation, one.contact.position, {one.torque, one.force}) *
           sign_on(one, has);
  for (std::size_t i = 0; i < motion.inverse.closures.size(); ++i) {
    const Closure& closure = model.closures()[i];
    const auto on = [&](int body, int frame) {
      return body == part.body && frame >= 0 && part.holds(frame) ? 1.0 : 0.0;
    };
    const ClosureForce& one = motion.inverse.closures[i];
    out -= moved_to(X_WB.translation, one.position, one.force) *
           (on(closure.body_b, closure.frame_b) - on(closure.body_a, closure.frame_a));
  }
  const auto push = [&](const std::vector<ExternalWrench>& wrenches) {
    for (const ExternalWrench& one : wrenches)
      if (one.body == part.body && part.holds(one.frame))
        out -= moved_to(X_WB.translation, X_WB * one.point, one.wrench);
  };
  if (motion.wrenches != nullptr) push(*motion.wrenches);
  push(motion.inverse.actuator_wrenches);
  for (const int child : part.children) {
    const Vector3 arm = motion.at.X_WB[static_cast<std::size_t>(child)].translation;
    out += moved_to(X_WB.translation, arm, motion.joints.of(child));
  }
  return out;
}

}  // namespace counterpoint
